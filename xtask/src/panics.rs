//! Whether a panic can be reached from the control tick, in the linked image.
//!
//! The linker leaves its relocations in the image (`--emit-relocs`, see `build.rs`), and so every place that names a
//! function or a datum: calls, jumps, and addresses that are only taken. What names what is a graph, in which no way
//! may lead from the roots to the panic handler. A function that is called through a pointer is on such a way too if
//! anything on it takes its address. What remains are pointers that others left in memory. In a control tick these are wakers, of the
//! one executor that there is, whose functions are roots themselves.

use std::collections::VecDeque;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::{
    File, Object, ObjectSection, ObjectSymbol, RelocationFlags, RelocationTarget, SectionFlags,
    SymbolKind, elf,
};
use rustc_demangle::demangle;

/// The interrupts of the control tick, the ways out when the firmware cannot go on, the control loop, and what wakes the link.
const ROOTS: [&str; 6] = [
    "ADC1_2",
    "UART5",
    "HardFault",
    "NonMaskableInt",
    "mirror_firmware::control::Control::",
    "embassy_executor::raw::waker::",
];

/// Where every panic ends.
const PANIC: &str = "__rustc::rust_begin_unwind";

/// Fails where a panic can be reached from the control tick of the driver board's image.
pub(crate) fn check(image: &Path) -> Result<()> {
    let graph = Graph::of(image)?;
    let roots = graph.roots(&ROOTS)?;
    let (reached, way) = graph.search(&roots)?;
    if let Some(way) = way {
        anyhow::bail!("the control tick can panic: {}", way.join(" -> "));
    }
    println!(
        "panics    none can be reached from {} roots of the control tick, through {reached} functions and data",
        roots.len()
    );
    Ok(())
}

/// Fails where the search misses that `image`, the emulated board's, can panic: it does when its plant asks for it.
pub(crate) fn check_that_it_finds_one(image: &Path) -> Result<()> {
    let graph = Graph::of(image)?;
    let (_, way) = graph.search(&graph.roots(&["main"])?)?;
    let way = way.context("the search for panics misses those of the emulated board")?;
    println!("panics    found where they may be: {}", way.join(" -> "));
    Ok(())
}

/// Something with an address, from the first to before the last.
struct Node {
    name: String,
    from: u64,
    to: u64,
}

/// What names what.
struct Graph {
    /// By address.
    nodes: Vec<Node>,
    names: Vec<Vec<usize>>,
}

/// A place in the image, and the address that it names.
struct Reference {
    from: u64,
    to: u64,
}

impl Graph {
    fn of(image: &Path) -> Result<Self> {
        let bytes = fs::read(image).with_context(|| format!("reading {}", image.display()))?;
        let file = File::parse(&*bytes)?;
        let references = references(&file)?;
        ensure!(
            !references.is_empty(),
            "the image holds no relocations; was it linked with --emit-relocs?"
        );
        Ok(Self::new(named(&file)?, &references))
    }

    /// The graph of these nodes. Data without a name are nodes, too, from one address that is referred to to the next.
    fn new(mut nodes: Vec<Node>, references: &[Reference]) -> Self {
        nodes.sort_by_key(|node| node.from);
        let mut unnamed: Vec<u64> = references
            .iter()
            .map(|reference| reference.to)
            .filter(|address| owner(&nodes, *address).is_none())
            .collect();
        unnamed.sort_unstable();
        unnamed.dedup();
        let mut starts: Vec<u64> = nodes.iter().map(|node| node.from).collect();
        starts.extend(&unnamed);
        starts.sort_unstable();
        let end = |from: &u64| {
            let after = starts.partition_point(|start| start <= from);
            starts.get(after).copied().unwrap_or(u64::MAX)
        };
        let ends: Vec<u64> = unnamed.iter().map(end).collect();
        nodes.extend(unnamed.into_iter().zip(ends).map(|(from, to)| Node {
            name: format!("data at {from:#x}"),
            from,
            to,
        }));
        nodes.sort_by_key(|node| node.from);
        let mut names = vec![Vec::new(); nodes.len()];
        for reference in references {
            if let (Some(from), Some(to)) =
                (owner(&nodes, reference.from), owner(&nodes, reference.to))
            {
                names[from].push(to);
            }
        }
        Self { nodes, names }
    }

    /// The nodes with these names, or whose names begin with them where they end in `::`.
    fn roots(&self, names: &[&str]) -> Result<Vec<usize>> {
        let mut roots = Vec::new();
        for name in names {
            let before = roots.len();
            let is_it = |node: &Node| match name.ends_with("::") {
                true => node.name.starts_with(name),
                false => node.name == *name,
            };
            roots.extend((0..self.nodes.len()).filter(|i| is_it(&self.nodes[*i])));
            ensure!(roots.len() > before, "the image holds no `{name}`");
        }
        Ok(roots)
    }

    /// How many nodes can be reached from `roots`, and the shortest way to the panic handler, if there is one.
    fn search(&self, roots: &[usize]) -> Result<(usize, Option<Vec<String>>)> {
        let panic = self.roots(&[PANIC])?[0];
        let mut from: Vec<Option<usize>> = vec![None; self.nodes.len()];
        let mut queue: VecDeque<usize> = roots.iter().copied().collect();
        roots.iter().for_each(|root| from[*root] = Some(*root));
        let mut reached = 0;
        while let Some(node) = queue.pop_front() {
            reached += 1;
            for next in &self.names[node] {
                if from[*next].is_none() {
                    from[*next] = Some(node);
                    queue.push_back(*next);
                }
            }
        }
        let way = from[panic].map(|_| {
            let mut way = vec![panic];
            while let Some(before) = from[way[way.len() - 1]].filter(|from| !way.contains(from)) {
                way.push(before);
            }
            way.iter()
                .rev()
                .map(|node| self.nodes[*node].name.clone())
                .collect()
        });
        Ok((reached, way))
    }
}

/// The node that `address` lies in.
fn owner(nodes: &[Node], address: u64) -> Option<usize> {
    let after = nodes.partition_point(|node| node.from <= address);
    let nearest = after.checked_sub(1)?;
    (address < nodes[nearest].to).then_some(nearest)
}

/// Functions and data with a name and a size. Functions with several names have the first of them.
fn named(file: &File<'_>) -> Result<Vec<Node>> {
    let mut nodes: Vec<Node> = Vec::new();
    for symbol in file.symbols() {
        if !matches!(symbol.kind(), SymbolKind::Text | SymbolKind::Data) || symbol.size() == 0 {
            continue;
        }
        // The lowest bit of a function's address says that it is Thumb code.
        let from = symbol.address() & !u64::from(symbol.kind() == SymbolKind::Text);
        nodes.push(Node {
            name: format!("{:#}", demangle(symbol.name()?)),
            from,
            to: from + symbol.size(),
        });
    }
    nodes.sort_by(|a, b| (a.from, &a.name).cmp(&(b.from, &b.name)));
    nodes.dedup_by_key(|node| node.from);
    Ok(nodes)
}

/// The flags of a section that has its place in the chip's memory.
pub(crate) fn flags_in_memory<'data>(section: &impl ObjectSection<'data>) -> Option<u64> {
    match section.flags() {
        SectionFlags::Elf { sh_flags } if sh_flags & u64::from(elf::SHF_ALLOC) != 0 => {
            Some(sh_flags)
        }
        _ => None,
    }
}

fn references(file: &File<'_>) -> Result<Vec<Reference>> {
    let mut references = Vec::new();
    // What only a debugger reads names everything, and is nowhere in memory.
    let in_memory = |section: &_| flags_in_memory(section).is_some();
    for section in file.sections().filter(in_memory) {
        let data = section.data()?;
        for (from, relocation) in section.relocations() {
            let RelocationTarget::Symbol(symbol) = relocation.target() else {
                continue;
            };
            let mut to = file.symbol_by_index(symbol)?.address();
            let is_word = relocation.flags()
                == RelocationFlags::Elf {
                    r_type: elf::R_ARM_ABS32,
                };
            // What stands there says more than the symbol, which may be only the section's.
            if is_word
                && let Some(start) = from.checked_sub(section.address())
                && let Some(word) = data.get(start as usize..).and_then(<[u8]>::first_chunk)
            {
                to = u32::from_le_bytes(*word).into();
            }
            references.push(Reference { from, to: to & !1 });
        }
    }
    Ok(references)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(name: &str, from: u64) -> Node {
        Node {
            name: name.to_owned(),
            from,
            to: from + 16,
        }
    }

    /// `root` calls `a`, `a` takes the address of data without a name, and these name `b`, which may panic.
    fn graph(b_panics: bool) -> Graph {
        let nodes = vec![
            node("root", 0),
            node("a", 16),
            node("b", 32),
            node(PANIC, 48),
        ];
        let mut references = vec![(4, 16), (20, 100), (104, 32), (108, 200), (204, 48)];
        if b_panics {
            references.push((36, 48));
        }
        let reference = |(from, to)| Reference { from, to };
        Graph::new(
            nodes,
            &references.into_iter().map(reference).collect::<Vec<_>>(),
        )
    }

    #[test]
    fn a_way_to_the_panic_handler_is_found_through_data_and_told() {
        let graph = graph(true);
        let roots = graph.roots(&["root"]).expect("it is there");
        let (_, way) = graph.search(&roots).expect("a handler");
        let way = way.expect("a way");
        assert_eq!(way[..2], ["root", "a"]);
        assert_eq!(way[way.len() - 1], PANIC);
        assert!(graph.roots(&["nobody"]).is_err());
    }

    #[test]
    fn what_cannot_panic_cannot() {
        let mut graph = graph(false);
        // The data at 200 are named by those at 100.
        graph
            .names
            .iter_mut()
            .for_each(|names| names.retain(|to| graph.nodes[*to].from != 200));
        let roots = graph.roots(&["root"]).expect("it is there");
        assert_eq!(graph.search(&roots).expect("a handler"), (4, None));
    }
}
