//! Where operating systems differ: how signals come, what files may be to others, and how a serial device is opened.

#[cfg(unix)]
mod unix;
#[cfg(not(unix))]
mod windows;

#[cfg(unix)]
pub(crate) use unix::{
    Interrupts, ended_by_signal, is_device, private_file, serial_device, standard_output,
};
#[cfg(not(unix))]
pub(crate) use windows::{
    Interrupts, ended_by_signal, is_device, private_file, serial_device, standard_output,
};
