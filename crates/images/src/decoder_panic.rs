//! Running a third party's decoder so that a panic inside it becomes an error.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

use crate::error::DecoderPanic;

static INSTALL: Once = Once::new();

thread_local! {
    /// How many calls of [`catch_decoder_panic`] this thread is in.
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Runs `work` on this thread; a panic in it is an error and prints nothing.
///
/// Image decoders meet hostile files with arithmetic checks and `expect`s of their own. A panic
/// there says that the file is bad, not that we are, so it is answered like any other bad file.
/// Nothing that `work` borrows mutably is used after a panic. The first call wraps the process's
/// panic hook in one that stays silent inside `catch_decoder_panic` and is itself everywhere else.
pub fn catch_decoder_panic<T, E: From<DecoderPanic>>(
    work: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    INSTALL.call_once(|| {
        let hook = take_hook();
        set_hook(Box::new(move |info| {
            if DEPTH.get() == 0 {
                hook(info);
            }
        }));
    });
    DEPTH.set(DEPTH.get() + 1);
    let outcome = catch_unwind(AssertUnwindSafe(work));
    DEPTH.set(DEPTH.get() - 1);
    outcome.unwrap_or_else(|_| Err(DecoderPanic.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error() {
        let outcome: Result<(), DecoderPanic> = catch_decoder_panic(|| panic!("decoder bug"));
        assert!(outcome.unwrap_err().to_string().contains("damaged"));
        assert_eq!(catch_decoder_panic(|| Ok::<_, DecoderPanic>(3)), Ok(3));
        assert_eq!(DEPTH.get(), 0);
    }
}
