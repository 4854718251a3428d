//! The list: in which room each package lies, and which others it may use.

/// A folder of packages that are for the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Room {
    /// `crates/board`: what runs on the board.
    Board,
    /// `crates/lab`: what measures, models, identifies and diagnoses.
    Lab,
    /// `crates/virtual-bench`: what stands in for the board and the mirror.
    VirtualBench,
    /// Outside of `crates`: the firmware, the tool, the acceptance checks, this task runner.
    Program,
}

impl Room {
    pub(super) fn of(directory: &str) -> Self {
        match directory.split('/').collect::<Vec<_>>()[..] {
            ["crates", "board", _] => Self::Board,
            ["crates", "lab", _] => Self::Lab,
            ["crates", "virtual-bench", _] => Self::VirtualBench,
            _ => Self::Program,
        }
    }
}

/// A package of the workspace, and those of the workspace that it may use.
pub(super) type Allowed = (Room, &'static str, &'static [&'static str]);

/// All packages.
pub(super) const ALLOWED: &[Allowed] = &[
    (Room::Board, "calibration-store", &[]),
    (Room::Board, "control-core", &["fpu"]),
    (Room::Board, "fault-log", &[]),
    (Room::Board, "fpu", &[]),
    (Room::Board, "mirror-protocol", &["waveforms"]),
    (Room::Board, "protection", &["control-core"]),
    (Room::Board, "waveforms", &["control-core"]),
    (
        Room::Lab,
        "calibration",
        &[
            "control-core",
            "experiments",
            "least-squares",
            "measurement",
            "mirror-model",
        ],
    ),
    (
        Room::Lab,
        "calibration-procedure",
        &[
            "calibration",
            "control-core",
            "experiments",
            "identification",
            "measurement",
            "mirror-model",
        ],
    ),
    (Room::Lab, "charts", &[]),
    (
        Room::Lab,
        "diagnosis",
        &[
            "experiments",
            "identification",
            "mirror-model",
            "parallel",
            "virtual-mirror",
        ],
    ),
    (
        Room::Lab,
        "experiment-player",
        &["experiments", "measurement", "mirror-protocol", "waveforms"],
    ),
    (Room::Lab, "experiments", &[]),
    (
        Room::Lab,
        "identification",
        &[
            "experiments",
            "least-squares",
            "measurement",
            "mirror-model",
            "parallel",
        ],
    ),
    (Room::Lab, "input-file", &[]),
    (
        Room::Lab,
        "lab-view",
        &["charts", "identification", "measurement", "mirror-model"],
    ),
    (Room::Lab, "lab-view-wasm", &["lab-view"]),
    (Room::Lab, "least-squares", &[]),
    (Room::Lab, "measurement", &["input-file"]),
    (Room::Lab, "mirror-model", &["input-file"]),
    (Room::Lab, "parallel", &[]),
    (Room::Lab, "quantities", &[]),
    (Room::VirtualBench, "board-sockets", &[]),
    (
        Room::VirtualBench,
        "closed-loop",
        &[
            "calibration",
            "calibration-procedure",
            "control-core",
            "emulated-board",
            "experiment-player",
            "experiments",
            "measurement",
            "mirror-model",
            "mirror-protocol",
            "virtual-mirror",
            "waveforms",
        ],
    ),
    (
        Room::VirtualBench,
        "emulated-board",
        &[
            "board-sockets",
            "foreign-mirror",
            "plant-link",
            "virtual-mirror",
        ],
    ),
    (Room::VirtualBench, "foreign-mirror", &[]),
    (
        Room::VirtualBench,
        "silicon-twin",
        &["emulated-board", "mirror-protocol", "virtual-mirror"],
    ),
    (
        Room::VirtualBench,
        "board-on-host",
        &[
            "emulated-board",
            "firmware-on-host",
            "mirror-protocol",
            "simulated-flash",
            "virtual-mirror",
            "virtual-usb",
        ],
    ),
    (
        Room::VirtualBench,
        "firmware-on-host",
        &[
            "control-core",
            "mirror-firmware",
            "mirror-protocol",
            "plant-link",
            "simulated-flash",
            "virtual-usb",
        ],
    ),
    (
        Room::VirtualBench,
        "fuzz",
        &[
            "calibration",
            "control-core",
            "firmware-on-host",
            "measurement",
            "mirror-model",
            "mirror-protocol",
            "virtual-usb",
        ],
    ),
    (
        Room::VirtualBench,
        "missing-physics-bench",
        &[
            "diagnosis",
            "experiments",
            "identification",
            "measurement",
            "mirror-model",
            "virtual-mirror",
            "virtual-sessions",
        ],
    ),
    (
        Room::VirtualBench,
        "mirror-emulator",
        &[
            "board-on-host",
            "board-sockets",
            "emulated-board",
            "quantities",
            "silicon-twin",
            "virtual-mirror",
        ],
    ),
    (Room::VirtualBench, "headless-browser", &[]),
    (Room::VirtualBench, "long-runs", &[]),
    (Room::VirtualBench, "plant-link", &[]),
    (Room::VirtualBench, "shared-cache", &[]),
    (Room::VirtualBench, "simulated-flash", &[]),
    (Room::VirtualBench, "virtual-mirror", &[]),
    (
        Room::VirtualBench,
        "virtual-sessions",
        &["experiments", "measurement", "virtual-mirror"],
    ),
    (Room::VirtualBench, "virtual-usb", &[]),
    (
        Room::VirtualBench,
        "workbench",
        &[
            "board-on-host",
            "calibration",
            "charts",
            "closed-loop",
            "control-core",
            "diagnosis",
            "emulated-board",
            "experiments",
            "foreign-mirror",
            "host-tool",
            "identification",
            "long-runs",
            "measurement",
            "mirror-emulator",
            "mirror-model",
            "mirror-protocol",
            "silicon-twin",
            "virtual-mirror",
            "virtual-sessions",
            "xtask",
        ],
    ),
    (
        Room::Program,
        "hil",
        &[
            "board-on-host",
            "emulated-board",
            "host-tool",
            "measurement",
            "mirror-protocol",
            "silicon-twin",
            "virtual-mirror",
        ],
    ),
    (
        Room::Program,
        "host-tool",
        &[
            "board-sockets",
            "calibration",
            "calibration-procedure",
            "charts",
            "control-core",
            "diagnosis",
            "experiment-player",
            "experiments",
            "identification",
            "input-file",
            "lab-view",
            "measurement",
            "mirror-model",
            "mirror-protocol",
            "protection",
            "quantities",
        ],
    ),
    (
        Room::Program,
        "mirror-firmware",
        &[
            "calibration-store",
            "control-core",
            "fault-log",
            "mirror-protocol",
            "plant-link",
            "protection",
            "simulated-flash",
            "virtual-usb",
            "waveforms",
        ],
    ),
    (
        Room::Program,
        "xtask",
        &["headless-browser", "long-runs", "shared-cache"],
    ),
];
