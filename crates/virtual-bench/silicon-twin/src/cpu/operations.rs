//! What instructions do, apart from where they find their operands (ARMv7-M manual, chapters A5 and A7).

/// Whether the condition flags follow the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flags {
    /// Never.
    Keep,
    /// Always.
    Set,
    /// Outside an IT block only, as most 16-bit encodings.
    SetOutsideIt,
}

/// Two-operand operations of the arithmetic unit (section A5.3.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum Operation {
    And,
    Bic,
    Orr,
    Orn,
    Eor,
    Add,
    Adc,
    Sub,
    Sbc,
    Rsb,
    Mov,
    Mvn,
    Tst,
    Teq,
    Cmp,
    Cmn,
}

/// How an operand is shifted (section A7.4.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum Shift {
    Lsl,
    Lsr,
    Asr,
    Ror,
    Rrx,
}

/// What a load or a store moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named by what they do")]
pub enum Access {
    LoadWord,
    LoadHalf,
    LoadByte,
    LoadSignedHalf,
    LoadSignedByte,
    StoreWord,
    StoreHalf,
    StoreByte,
}

/// How an address is formed of base and offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Index {
    /// Base and offset; the base stays.
    Offset,
    /// Base and offset, which becomes the base.
    Before,
    /// The base, which then moves by the offset.
    After,
}

/// Extensions of a byte or half-word (SXTB and its kin).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum Extension {
    Sxth,
    Uxth,
    Sxtb16,
    Uxtb16,
    Sxtb,
    Uxtb,
}

/// Operations on one core register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum Bits {
    Rev,
    Rev16,
    Rbit,
    Revsh,
    Clz,
}

/// Multiplications with a 32-bit result, and some that add to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum Product {
    Mul,
    Mla,
    Mls,
    /// SMLAxy: which halves of the two factors.
    Smla {
        n_top: bool,
        m_top: bool,
    },
    /// SMULxy.
    Smul {
        n_top: bool,
        m_top: bool,
    },
    Smlaw {
        m_top: bool,
    },
    Smulw {
        m_top: bool,
    },
    Smmul {
        round: bool,
    },
    Smmla {
        round: bool,
    },
    Smmls {
        round: bool,
    },
}

/// Multiplications with a 64-bit result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum LongProduct {
    Smull,
    Umull,
    Smlal,
    Umlal,
    Umaal,
}

/// Saturating additions (section A7.7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum Saturating {
    Qadd,
    Qdadd,
    Qsub,
    Qdsub,
}

/// Additions and subtractions in the lanes of a register (section A7.7, parallel addition and subtraction).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum Lanes {
    Add8,
    Sub8,
    Add16,
    Sub16,
    /// Exchanges the halves of the second operand, subtracts below and adds above.
    Asx,
    /// The same with addition below.
    Sax,
}

/// What becomes of a lane's result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LaneResult {
    /// It wraps, and GE tells of it.
    Wrap,
    /// It is limited.
    Saturate,
    /// It is halved.
    Halve,
}

/// What the processor is told without operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum Hint {
    Nop,
    Wfe,
    Wfi,
    Sev,
}

/// Floating-point operations on two operands, and the destination where they accumulate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum FloatOperation {
    Mla,
    Mls,
    Nmla,
    Nmls,
    Mul,
    Nmul,
    Add,
    Sub,
    Div,
    Fma,
    Fms,
    Fnma,
    Fnms,
}

/// Floating-point operations on one operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the manual")]
pub enum FloatUnary {
    Mov,
    Abs,
    Neg,
    Sqrt,
}

/// Conversions between integers and single precision, in place or to another register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Conversion {
    /// From an integer.
    FromInteger {
        /// Whether it has a sign.
        signed: bool,
    },
    /// To an integer.
    ToInteger {
        /// Whether it has a sign.
        signed: bool,
        /// Towards zero, instead of to the nearest.
        to_zero: bool,
    },
    /// From a fixed-point number with so many bits behind the point.
    FromFixed {
        /// Whether it has a sign.
        signed: bool,
        /// Bits of the number: 16 or 32.
        bits: u8,
        /// Those behind the point.
        fraction: u8,
    },
    /// To a fixed-point number, towards zero.
    ToFixed {
        /// Whether it has a sign.
        signed: bool,
        /// Bits of the number: 16 or 32.
        bits: u8,
        /// Those behind the point.
        fraction: u8,
    },
}
