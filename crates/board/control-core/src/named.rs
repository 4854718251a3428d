//! Enums whose variants have a code, in the order in which they stand, and a name for people and scripts.

/// Makes such an enum: its [`ALL`](crate::Limit::ALL) and [`name`](crate::Limit::name).
#[macro_export]
macro_rules! named {
    ($(#[$meta:meta])* pub enum $enum:ident { $($(#[$doc:meta])* $variant:ident = $name:literal,)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $enum {
            $($(#[$doc])* $variant,)*
        }

        impl $enum {
            /// All of them, in the order of their codes.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$variant),*];

            /// The name that people see and scripts use.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}
