//! The second way to stop the board: UART1, which QEMU connects to two FIFOs. Any number of processes may write into a
//! FIFO at once, so that none can keep it from the others, as one that holds the link's socket does.

use embassy_futures::yield_now;

use super::uart::{UART1, Uart};
use crate::mailbox::LinkSide;

/// Takes every byte for a stop, and sends it back once a tick has carried it out, for ever.
pub async fn serve(mailbox: LinkSide) -> ! {
    let mut uart = Uart::enable(UART1);
    loop {
        if let Some(byte) = uart.try_read() {
            mailbox.stop();
            while mailbox.is_stopping() {
                yield_now().await;
            }
            // Where nobody fetches the answers there is no room for more, and nobody to miss them.
            uart.try_write(byte);
        }
        // The control loop runs in between, so this polls once a tick.
        yield_now().await;
    }
}
