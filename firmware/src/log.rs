//! Logging: the `log` crate or defmt, whichever the board has a logger for, else nothing.
//!
//! Only what both can show is logged: numbers, texts, addresses.

macro_rules! info {
    ($($message:tt)*) => {{
        #[cfg(feature = "log")]
        ::log::info!($($message)*);
        #[cfg(all(feature = "defmt", not(feature = "log")))]
        ::defmt::info!($($message)*);
        #[cfg(not(any(feature = "defmt", feature = "log")))]
        let _ = ::core::format_args!($($message)*);
    }};
}

macro_rules! warning {
    ($($message:tt)*) => {{
        #[cfg(feature = "log")]
        ::log::warn!($($message)*);
        #[cfg(all(feature = "defmt", not(feature = "log")))]
        ::defmt::warn!($($message)*);
        #[cfg(not(any(feature = "defmt", feature = "log")))]
        let _ = ::core::format_args!($($message)*);
    }};
}

pub(crate) use {info, warning};
