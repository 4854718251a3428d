//! The interrupts that are modelled (RM0440, table 97). A test holds them against ST's data.

macro_rules! interrupts {
    ($($name:ident = $number:literal;)*) => {
        $(pub(crate) const $name: u32 = $number;)*
        /// All of them, by ST's names.
        #[cfg(test)]
        pub(crate) const ALL: &[(&str, u32)] = &[$((stringify!($name), $number)),*];
    };
}

interrupts! {
    FLASH = 4;
    ADC1_2 = 18;
    USB_LP = 20;
    TIM1_BRK_TIM15 = 24;
    TIM1_UP_TIM16 = 25;
    TIM1_CC = 27;
}
