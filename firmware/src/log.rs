//! Logging: the `log` crate where a board has a logger for it, else nothing.

macro_rules! info {
    ($($message:tt)*) => {{
        #[cfg(feature = "log")]
        ::log::info!($($message)*);
        #[cfg(not(feature = "log"))]
        let _ = ::core::format_args!($($message)*);
    }};
}

macro_rules! warning {
    ($($message:tt)*) => {{
        #[cfg(feature = "log")]
        ::log::warn!($($message)*);
        #[cfg(not(feature = "log"))]
        let _ = ::core::format_args!($($message)*);
    }};
}

pub(crate) use {info, warning};
