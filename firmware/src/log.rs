//! Logging: `log` on a desktop, nothing where a board brings no logger.

macro_rules! info {
    ($($message:tt)*) => {{
        #[cfg(feature = "std")]
        ::log::info!($($message)*);
        #[cfg(not(feature = "std"))]
        let _ = ::core::format_args!($($message)*);
    }};
}

macro_rules! warning {
    ($($message:tt)*) => {{
        #[cfg(feature = "std")]
        ::log::warn!($($message)*);
        #[cfg(not(feature = "std"))]
        let _ = ::core::format_args!($($message)*);
    }};
}

pub(crate) use {info, warning};
