#!/bin/sh
# On a clean Debian, in which the packages lie in /bench: installs each as its readers would, and moves a mirror by it.
set -eu
export DEBIAN_FRONTEND=noninteractive
cd /bench
useradd --create-home person

# What is typed as a person without rights.
types() {
    echo "person> $1"
    su - person --shell /bin/sh --command "$1"
}

# Whether what follows moves an emulated mirror to 120 um, as far as that goes before it is calibrated: 10.8 um, the error before
# in docs/guide/calibrate.md.
moves() {
    types "$1" | tee /tmp/said
    awk '/^moved to/ { found = 1; near = ($3 > 109.2 && $3 < 130.8) } END { exit !(found && near) }' /tmp/said
}

apt-get install -y -qq --no-install-recommends ./electrothermal-mirror_*.deb
types "host-tool --version"
test -s /usr/share/man/man1/host-tool-set-z.1
echo "Without QEMU, the boards that need none are there, and what to install is said:"
types "mirror-emulator --board g474 -- set-z 120um"
moves "mirror-emulator --board host -- set-z 120um"
types "mirror-emulator -- set-z 120um" 2>&1 | tee /tmp/said && grep -q "apt-get install qemu-system-arm" /tmp/said
apt-get install -y -qq --no-install-recommends qemu-system-arm
moves "mirror-emulator -- set-z 120um"
apt-get remove -y -qq electrothermal-mirror
if command -v host-tool; then
    echo "it is removed, and still there"
    exit 1
fi

apt-get install -y -qq --no-install-recommends python3-venv
types "python3 -m venv bench && bench/bin/pip install --quiet --no-index --find-links /bench electrothermal-mirror"
moves "bench/bin/mirror-emulator -- set-z 120um"
types "bench/bin/python -c '
from electrothermal_mirror import Mirror
with Mirror.emulated() as mirror:
    mirror.move(120e-6)
    assert abs(mirror.position() - 120e-6) < 10.8e-6, mirror.position()
    print(\"from Python:\", mirror.position())
'"
echo "All packages are installed, and have moved a mirror."
