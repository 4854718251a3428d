//! What each instruction does, and the cycles that it takes (Cortex-M4 TRM, table 3-1).

use super::arithmetic::shift_c;
use super::instruction::{Hint, Instruction};
use super::memory::REFILL;
use super::{Bus, Cpu, Executed, Fault, Halt, LR, PC, Sleep, Trap};

impl Cpu {
    #[inline]
    fn of(&self, register: u8) -> u32 {
        self.r[usize::from(register)]
    }

    /// Writes a result; into the program counter, it is a branch.
    #[inline]
    fn put(&mut self, rd: u8, value: u32) -> Executed {
        let rd = usize::from(rd);
        if rd == PC {
            self.next = value & !1;
            return Ok(1 + REFILL);
        }
        self.r[rd] = value;
        Ok(1)
    }

    #[inline]
    fn branch(&mut self, offset: i32) -> Executed {
        self.next = self.r[PC].wrapping_add_signed(offset);
        Ok(1 + REFILL)
    }

    #[inline]
    pub(super) fn execute(&mut self, bus: &mut impl Bus, instruction: &Instruction) -> Executed {
        use Instruction as I;
        match *instruction {
            I::Immediate {
                op,
                flags,
                rd,
                rn,
                carry,
                imm,
            } => {
                let carry = carry.unwrap_or(self.c);
                match self.operate(op, flags, self.of(rn), imm, carry) {
                    Some(result) => self.put(rd, result),
                    None => Ok(1),
                }
            }
            I::Shifted {
                op,
                flags,
                rd,
                rn,
                rm,
                shift,
                amount,
            } => {
                let (y, carry) = shift_c(self.of(rm), shift, amount.into(), self.c);
                match self.operate(op, flags, self.of(rn), y, carry) {
                    Some(result) => self.put(rd, result),
                    None => Ok(1),
                }
            }
            I::Memory {
                access,
                index,
                rt,
                rn,
                offset,
            } => self.access_at(bus, access, index, rt, rn, offset),
            I::MemoryRegister {
                access,
                rt,
                rn,
                rm,
                amount,
            } => {
                let address = self.of(rn).wrapping_add(self.of(rm) << amount);
                self.access(bus, access, rt, address, None)
            }
            I::Branch { offset } => self.branch(offset),
            I::BranchIf { condition, offset } => match self.is_met(condition) {
                true => self.branch(offset),
                false => Ok(1),
            },
            I::CompareBranch {
                nonzero,
                rn,
                offset,
            } => match (self.of(rn) != 0) == nonzero {
                true => self.branch(offset.into()),
                false => Ok(1),
            },
            I::IfThen { state } => {
                self.it = state;
                Ok(1)
            }
            I::Float { .. }
            | I::FloatUnary { .. }
            | I::FloatImmediate { .. }
            | I::FloatCompare { .. }
            | I::FloatConvert { .. }
            | I::FloatMemory { .. }
            | I::FloatMultiple { .. }
            | I::FloatMove { .. }
            | I::FloatMovePair { .. }
            | I::FloatStatusRead { .. }
            | I::FloatStatusWrite { .. } => {
                self.float_check(bus)?;
                self.execute_float(bus, instruction)
            }
            _ => self.execute_other(bus, instruction),
        }
    }

    fn execute_other(&mut self, bus: &mut impl Bus, instruction: &Instruction) -> Executed {
        use Instruction as I;
        match *instruction {
            I::ShiftBy {
                shift,
                flags,
                rd,
                rn,
                rm,
            } => self.shift_by(shift, flags, rd, rn, rm),
            I::Adr { rd, offset } => {
                return self.put(rd, (self.r[PC] & !3).wrapping_add_signed(offset));
            }
            I::MoveTop { rd, imm } => {
                let low = self.of(rd) & 0xffff;
                self.r[usize::from(rd)] = u32::from(imm) << 16 | low;
            }
            I::Dual {
                load,
                index,
                rt,
                rt2,
                rn,
                offset,
            } => return self.access_two(bus, load, index, [rt, rt2, rn], offset),
            I::Multiple {
                load,
                decrement,
                writeback,
                rn,
                registers,
            } => return self.access_multiple(bus, load, decrement, writeback, rn, registers),
            I::LoadExclusive {
                bytes,
                rt,
                rn,
                offset,
            } => {
                let address = self.of(rn).wrapping_add(offset.into());
                return self.load_exclusive(bus, bytes, rt, address);
            }
            I::StoreExclusive {
                bytes,
                rd,
                rt,
                rn,
                offset,
            } => {
                let address = self.of(rn).wrapping_add(offset.into());
                return self.store_exclusive(bus, bytes, [rd, rt], address);
            }
            I::ClearExclusive => self.exclusive = None,
            I::BranchLink { offset } => {
                self.r[LR] = self.next | 1;
                return self.branch(offset);
            }
            I::BranchExchange { link, rm } => {
                let target = self.of(rm);
                if link {
                    self.r[LR] = self.next | 1;
                }
                self.branch_exchange(bus, target)?;
                return Ok(1 + REFILL);
            }
            I::TableBranch { half, rn, rm } => {
                let (base, index) = (self.of(rn), self.of(rm));
                let halfwords = match half {
                    true => self.load::<2>(bus, base.wrapping_add(index << 1))?,
                    false => self.load::<1>(bus, base.wrapping_add(index))?,
                };
                self.next = self.r[PC].wrapping_add(2 * halfwords);
                return Ok(2 + REFILL);
            }
            I::Hint(hint) => self.hint(hint),
            I::Barrier => {}
            I::SupervisorCall => self.system.pend_supervisor_call(),
            I::Breakpoint => {
                let what = "a debugger, which this breakpoint calls".to_owned();
                return Err(Trap::Halt(Halt::NotModelled(what)));
            }
            I::Undefined => return Err(Trap::Fault(Fault::undefined())),
            I::ChangeState {
                disable,
                primask,
                faultmask,
            } => {
                if primask {
                    self.primask = disable;
                }
                if faultmask {
                    self.faultmask = disable;
                }
                self.system.attention = true;
            }
            I::ReadSpecial { rd, special } => return self.read_special(rd, special),
            I::WriteSpecial { rn, special } => return self.write_special(special, self.of(rn)),
            I::Multiply {
                product,
                flags,
                rd,
                rn,
                rm,
                ra,
            } => return Ok(self.multiply(product, flags, rd, [rn, rm, ra].map(|r| self.of(r)))),
            I::MultiplyLong {
                product,
                lo,
                hi,
                rn,
                rm,
            } => self.multiply_long(product, lo, hi, self.of(rn), self.of(rm)),
            I::Divide { signed, rd, rn, rm } => {
                return self.divide(signed, rd, self.of(rn), self.of(rm));
            }
            I::Extend {
                extension,
                rd,
                rn,
                rm,
                rotation,
            } => self.extend(extension, rd, rn, rm, rotation),
            I::BitFieldInsert { rd, rn, lsb, width } => self.insert(rd, rn, lsb, width),
            I::BitFieldExtract {
                signed,
                rd,
                rn,
                lsb,
                width,
            } => self.extract(signed, rd, rn, lsb, width),
            I::Bits { op, rd, rm } => self.bits(op, rd, rm),
            I::Saturate {
                signed,
                rd,
                rn,
                bits,
                shift,
                amount,
            } => {
                let (value, _) = shift_c(self.of(rn), shift, amount.into(), self.c);
                self.saturate_to(signed, rd, value, bits);
            }
            I::Parallel {
                lanes,
                result,
                signed,
                rd,
                rn,
                rm,
            } => self.parallel(lanes, result, signed, [rd, rn, rm]),
            I::Select { rd, rn, rm } => self.select(rd, rn, rm),
            I::AddSaturating { op, rd, rn, rm } => self.add_saturating(op, rd, rn, rm),
            I::Pack {
                top,
                rd,
                rn,
                rm,
                amount,
            } => {
                let (n, m) = (self.of(rn), self.of(rm));
                let shifted = match top {
                    true => (m as i32 >> amount.min(31)) as u32,
                    false => m << amount,
                };
                self.r[usize::from(rd)] = match top {
                    true => n & 0xffff_0000 | shifted & 0xffff,
                    false => shifted & 0xffff_0000 | n & 0xffff,
                };
            }
            _ => {
                let what = "this instruction".to_owned();
                return Err(Trap::Halt(Halt::NotModelled(what)));
            }
        }
        Ok(1)
    }

    fn execute_float(&mut self, bus: &mut impl Bus, instruction: &Instruction) -> Executed {
        use Instruction as I;
        match *instruction {
            I::Float { op, d, n, m } => Ok(self.float(op, d, n, m)),
            I::FloatUnary { op, d, m } => Ok(self.float_unary(op, d, m)),
            I::FloatImmediate { d, bits } => {
                self.s[usize::from(d)] = bits;
                Ok(1)
            }
            I::FloatCompare { d, m } => {
                self.float_compare(d, m);
                Ok(1)
            }
            I::FloatConvert { conversion, d, m } => {
                self.float_convert(conversion, d, m);
                Ok(1)
            }
            I::FloatMemory {
                load,
                words,
                d,
                rn,
                offset,
            } => {
                let base = match usize::from(rn) {
                    PC => self.r[PC] & !3,
                    rn => self.r[rn],
                };
                let address = base.wrapping_add_signed(offset.into());
                self.float_access(bus, load, words, d, address)
            }
            I::FloatMultiple {
                load,
                decrement,
                writeback,
                words,
                d,
                rn,
            } => self.float_access_multiple(bus, [load, decrement, writeback], words, d, rn),
            I::FloatMove { to_core, rt, n } => {
                match to_core {
                    true => self.r[usize::from(rt)] = self.s[usize::from(n)],
                    false => self.s[usize::from(n)] = self.of(rt),
                }
                Ok(1)
            }
            I::FloatMovePair {
                to_core,
                rt,
                rt2,
                m,
            } => {
                for (register, single) in [rt, rt2].into_iter().zip(usize::from(m)..) {
                    match to_core {
                        true => self.r[usize::from(register)] = self.s[single],
                        false => self.s[single] = self.of(register),
                    }
                }
                Ok(2)
            }
            I::FloatStatusRead { rt } => self.float_status_read(rt),
            I::FloatStatusWrite { rt } => self.float_status_write(self.of(rt)),
            _ => unreachable!("only floating-point instructions come here"),
        }
    }

    fn hint(&mut self, hint: Hint) {
        match hint {
            Hint::Nop => {}
            Hint::Sev => self.has_event = true,
            Hint::Wfe if self.has_event => self.has_event = false,
            Hint::Wfe => self.fall_asleep(Sleep::ForEvent),
            Hint::Wfi => self.fall_asleep(Sleep::ForInterrupt),
        }
    }
}
