//! The choice of an instruction set at run time.
//!
//! Each set costs a copy of the code and its compilation. So there are two on x86: AVX2 with FMA, than
//! which AVX-512 was 0 to 8 % faster on eight lanes, and SSE2, which every processor has.

/// Runs `op` with the token `simd` of the best instruction set at a [`Level`](crate::wide::Level), its
/// code compiled for that set: `dispatch!(level, simd => op)`.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
#[macro_export]
macro_rules! wide_dispatch {
    ($level:expr, $simd:pat => $op:expr) => {{
        let level: $crate::wide::Level = $level;
        if let Some(token) = level.as_avx2() {
            $crate::wide_vectorize!(token, $simd => $op)
        } else if let Some(token) = level.as_sse2() {
            $crate::wide_vectorize!(token, $simd => $op)
        } else {
            $crate::wide_fallback!(level, $simd => $op)
        }
    }};
}

/// One arm of [`wide_dispatch`].
#[doc(hidden)]
#[macro_export]
macro_rules! wide_vectorize {
    ($token:expr, $simd:pat => $op:expr) => {{
        let token = $token;
        $crate::wide::Simd::vectorize(
            token,
            #[inline(always)]
            || {
                let $simd = token;
                $op
            },
        )
    }};
}

/// Without any instruction set, which tests alone ask for on x86.
#[cfg(all(
    test,
    feature = "fallback",
    any(target_arch = "x86", target_arch = "x86_64")
))]
#[doc(hidden)]
#[macro_export]
macro_rules! wide_fallback {
    ($level:expr, $simd:pat => $op:expr) => {
        match $level {
            $crate::wide::Level::Fallback(token) => $crate::wide_vectorize!(token, $simd => $op),
            _ => unreachable!("every other level has SSE2"),
        }
    };
}

/// Without any instruction set, which tests alone ask for on x86.
#[cfg(all(
    not(all(test, feature = "fallback")),
    any(target_arch = "x86", target_arch = "x86_64")
))]
#[doc(hidden)]
#[macro_export]
macro_rules! wide_fallback {
    ($level:expr, $simd:pat => $op:expr) => {
        unreachable!("Rust's x86 targets have SSE2")
    };
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
pub use crate::wide_dispatch as dispatch;
#[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
pub use fearless_simd::dispatch;
