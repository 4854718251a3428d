//! Decoded instructions of ARMv7E-M with the single-precision floating-point extension.
//!
//! Source of all encodings and their meaning: ARMv7-M Architecture Reference Manual (DDI 0403E), chapter A7.

/// A core register, 0 to 15.
pub type Register = u8;
/// A single-precision register, 0 to 31.
pub type Single = u8;

pub use super::operations::*;

/// An instruction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "operands are named as in the manual")]
pub enum Instruction {
    /// An operation with a constant; `carry` is what the constant's rotation leaves in the carry.
    Immediate {
        op: Operation,
        flags: Flags,
        rd: Register,
        rn: Register,
        carry: Option<bool>,
        imm: u32,
    },
    Shifted {
        op: Operation,
        flags: Flags,
        rd: Register,
        rn: Register,
        rm: Register,
        shift: Shift,
        amount: u8,
    },
    /// A shift by a register.
    ShiftBy {
        shift: Shift,
        flags: Flags,
        rd: Register,
        rn: Register,
        rm: Register,
    },
    /// Base of the literals in the code, and an offset.
    Adr {
        rd: Register,
        offset: i32,
    },
    /// MOVT: the upper half only.
    MoveTop {
        rd: Register,
        imm: u16,
    },
    Memory {
        access: Access,
        index: Index,
        rt: Register,
        rn: Register,
        offset: i32,
    },
    MemoryRegister {
        access: Access,
        rt: Register,
        rn: Register,
        rm: Register,
        amount: u8,
    },
    Dual {
        load: bool,
        index: Index,
        rt: Register,
        rt2: Register,
        rn: Register,
        offset: i32,
    },
    Multiple {
        load: bool,
        decrement: bool,
        writeback: bool,
        rn: Register,
        registers: u16,
    },
    LoadExclusive {
        bytes: u8,
        rt: Register,
        rn: Register,
        offset: u16,
    },
    StoreExclusive {
        bytes: u8,
        rd: Register,
        rt: Register,
        rn: Register,
        offset: u16,
    },
    ClearExclusive,
    Branch {
        offset: i32,
    },
    BranchIf {
        condition: u8,
        offset: i32,
    },
    BranchLink {
        offset: i32,
    },
    BranchExchange {
        link: bool,
        rm: Register,
    },
    CompareBranch {
        nonzero: bool,
        rn: Register,
        offset: u8,
    },
    TableBranch {
        half: bool,
        rn: Register,
        rm: Register,
    },
    IfThen {
        state: u8,
    },
    Hint(Hint),
    /// DMB, DSB, ISB: what this model does is in order anyway.
    Barrier,
    SupervisorCall,
    Breakpoint,
    Undefined,
    ChangeState {
        disable: bool,
        primask: bool,
        faultmask: bool,
    },
    ReadSpecial {
        rd: Register,
        special: u8,
    },
    WriteSpecial {
        rn: Register,
        special: u8,
    },
    Multiply {
        product: Product,
        flags: Flags,
        rd: Register,
        rn: Register,
        rm: Register,
        ra: Register,
    },
    MultiplyLong {
        product: LongProduct,
        lo: Register,
        hi: Register,
        rn: Register,
        rm: Register,
    },
    Divide {
        signed: bool,
        rd: Register,
        rn: Register,
        rm: Register,
    },
    /// `rn` 15: nothing is added.
    Extend {
        extension: Extension,
        rd: Register,
        rn: Register,
        rm: Register,
        rotation: u8,
    },
    /// `rn` 15: zeroes.
    BitFieldInsert {
        rd: Register,
        rn: Register,
        lsb: u8,
        width: u8,
    },
    BitFieldExtract {
        signed: bool,
        rd: Register,
        rn: Register,
        lsb: u8,
        width: u8,
    },
    Bits {
        op: Bits,
        rd: Register,
        rm: Register,
    },
    Saturate {
        signed: bool,
        rd: Register,
        rn: Register,
        bits: u8,
        shift: Shift,
        amount: u8,
    },
    AddSaturating {
        op: Saturating,
        rd: Register,
        rn: Register,
        rm: Register,
    },
    Parallel {
        lanes: Lanes,
        result: LaneResult,
        signed: bool,
        rd: Register,
        rn: Register,
        rm: Register,
    },
    /// SEL: bytes of one or the other register, by GE.
    Select {
        rd: Register,
        rn: Register,
        rm: Register,
    },
    Pack {
        top: bool,
        rd: Register,
        rn: Register,
        rm: Register,
        amount: u8,
    },
    Float {
        op: FloatOperation,
        d: Single,
        n: Single,
        m: Single,
    },
    FloatUnary {
        op: FloatUnary,
        d: Single,
        m: Single,
    },
    FloatImmediate {
        d: Single,
        bits: u32,
    },
    /// `m` none: with zero.
    FloatCompare {
        d: Single,
        m: Option<Single>,
    },
    FloatConvert {
        conversion: Conversion,
        d: Single,
        m: Single,
    },
    FloatMemory {
        load: bool,
        words: u8,
        d: Single,
        rn: Register,
        offset: i16,
    },
    FloatMultiple {
        load: bool,
        decrement: bool,
        writeback: bool,
        words: u8,
        d: Single,
        rn: Register,
    },
    FloatMove {
        to_core: bool,
        rt: Register,
        n: Single,
    },
    FloatMovePair {
        to_core: bool,
        rt: Register,
        rt2: Register,
        m: Single,
    },
    /// VMRS; `rt` 15: into the condition flags.
    FloatStatusRead {
        rt: Register,
    },
    FloatStatusWrite {
        rt: Register,
    },
    /// An encoding that this model does not know, be it undefined or not.
    Unknown,
}

/// An instruction and its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decoded {
    /// What to do.
    pub instruction: Instruction,
    /// Bytes: 2 or 4.
    pub bytes: u8,
}

/// Whether the first half-word says that a second one follows (section A5.1).
pub fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}
