use super::*;

const TABLE: usize = 0;

/// A device with endpoint 0 for control, 64 bytes of buffer in either direction.
fn device() -> Usb {
    let mut clock = Clock::new(100e6);
    let mut usb = Usb::new();
    usb.write(CNTR, FRES, &clock, Ok(())).expect("CNTR");
    clock.cycles += 101;
    usb.write(CNTR, CTR, &clock, Ok(())).expect("CNTR");
    usb.write(BCDR, DPPU, &clock, Ok(())).expect("BCDR");
    for (i, half) in [0x40, 0, 0x80, 1 << 15 | 1 << 10].into_iter().enumerate() {
        usb.write_memory(TABLE + 2 * i, 2, half).expect("the table");
    }
    let all = u32::from(CONTROL | VALID << 12 | NAK << 4);
    usb.write(0, all, &clock, Ok(())).expect("EP0R");
    usb.write(DADDR, EF, &clock, Ok(())).expect("DADDR");
    usb
}

#[test]
fn a_setup_packet_is_taken_told_and_turns_both_directions_to_nak() {
    let mut usb = device();
    let packet = [0x80, 6, 0, 1, 0, 0, 18, 0];
    assert_eq!(usb.setup(0, packet), Answer::Ack);
    assert!(usb.interrupts());
    assert_eq!(usb.read(ISTR), Ok(CTR | 1 << 4));
    assert_eq!(&usb.memory[0x80..0x88], packet);
    assert_eq!(usb.half(6) & 0x3ff, 8, "COUNT_RX");
    assert_eq!(usb.send(0, 0, &[], true), Answer::Nak);
    assert_eq!(usb.fetch(0, 0), Err(Answer::Nak));
    assert_eq!(
        usb.setup(0, packet),
        Answer::Silence,
        "the first was not taken yet"
    );
}

#[test]
fn endpoint_bits_are_toggled_cleared_or_written() {
    let mut usb = device();
    let clock = Clock::new(1e6);
    usb.setup(0, [0; 8]);
    // CTR_RX cleared by 0; STAT_TX from NAK to VALID by toggling its lowest bit; the type is written.
    let value = u32::from(CONTROL | CTR_TX | 0b01 << 4);
    usb.write(0, value, &clock, Ok(())).expect("EP0R");
    let endpoint = usb.endpoints[0];
    assert_eq!(endpoint & CTR_RX, 0);
    assert_eq!((endpoint & STAT_TX) >> 4, VALID);
    assert_eq!((endpoint & STAT_RX) >> 12, NAK, "not touched by 0");
    let (packet, toggle) = usb.fetch(0, 0).expect("a packet");
    assert_eq!((packet.len(), toggle), (0, true), "data 1 follows a setup");
    assert_eq!(usb.endpoints[0] & CTR_TX, CTR_TX);
}

#[test]
fn packets_that_do_not_fit_or_are_for_others_are_not_taken() {
    let mut usb = device();
    assert_eq!(
        usb.send(1, 0, &[0], false),
        Answer::Silence,
        "another address"
    );
    assert_eq!(usb.send(0, 0, &[0; 65], false), Answer::Stall, "too long");
    assert_eq!(usb.send(0, 0, &[0; 64], false), Answer::Ack);
    usb.bus_reset();
    assert_eq!(
        usb.send(0, 0, &[0], false),
        Answer::Silence,
        "after a reset"
    );
}

#[test]
fn it_must_not_start_before_its_transceiver() {
    let clock = Clock::new(100e6);
    let mut usb = Usb::new();
    usb.write(CNTR, FRES, &clock, Ok(())).expect("CNTR");
    assert!(usb.write(CNTR, 0, &clock, Ok(())).is_err());
}
