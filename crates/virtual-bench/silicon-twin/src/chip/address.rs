//! Where the peripherals are (RM0440, section 2.2.2). A test holds them against ST's data.

macro_rules! peripherals {
    ($($name:ident = $address:literal;)*) => {
        $(pub(crate) const $name: u32 = $address;)*
        /// All of them, by ST's names.
        #[cfg(test)]
        pub(crate) const ALL: &[(&str, u32)] = &[$((stringify!($name), $address)),*];
    };
}

peripherals! {
    CRS = 0x4000_2000;
    IWDG = 0x4000_3000;
    USB = 0x4000_5c00;
    USBRAM = 0x4000_6000;
    PWR = 0x4000_7000;
    SYSCFG = 0x4001_0000;
    EXTI = 0x4001_0400;
    TIM1 = 0x4001_2c00;
    TIM15 = 0x4001_4000;
    RCC = 0x4002_1000;
    FLASH = 0x4002_2000;
    GPIOA = 0x4800_0000;
    ADC1 = 0x5000_0000;
    DBGMCU = 0xe004_2000;
}

/// The first of the ports; each takes 1 KB.
pub(crate) const GPIO: u32 = GPIOA;
/// Ports A to G.
pub(crate) const GPIO_PORTS: u32 = 7;
