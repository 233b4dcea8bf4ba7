#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Tests the packages with real serial drivers: a virtual machine with two 16550s and an FTDI converter that is plugged and unplugged,
# with Debian's kernel, on this machine's root file system. Takes minutes, because it is emulated (TCG). Run by tools/check --deep.
# usage: run.sh PRISM.deb PRISM-TOOLS.deb PRISMSIM CACHE
# Exit code 0 if every check passed, 1 if one failed. CACHE keeps the kernel.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source=$(cd "$here/../../.." && pwd)
[ $# -eq 4 ] || { echo "run.sh: found $# arguments, expected PRISM.deb PRISM-TOOLS.deb PRISMSIM CACHE" >&2; exit 64; }
[ "$(id -u)" -eq 0 ] || { echo "run.sh: found user $(id -un), expected root: the guest reads all files of this machine" >&2; exit 1; }
deb=$1 tools=$2 prismsim=$3
cache=$(realpath --canonicalize-missing "$4")   # absolute, as the paths that modprobe prints
share=$cache/share
work=$(mktemp -d "${TMPDIR:-/tmp}/prism-deep.XXXXXX")
children=()
cleanup() { [ ${#children[@]} -eq 0 ] || kill "${children[@]}" 2>/dev/null || true; wait 2>/dev/null || true; rm -rf "$work"; }
trap cleanup EXIT

kernel_package=$(apt-cache depends linux-image-amd64 | awk '/Depends: linux-image/ {print $2; exit}')
if [ "$(cat "$cache/kernel-package" 2>/dev/null)" != "$kernel_package" ]; then
  rm -rf "$cache"
  mkdir -p "$share/kernel"
  (cd "$cache" && apt-get -qq -o APT::Sandbox::User= download "$kernel_package" && dpkg-deb --extract "$kernel_package"_*.deb share/kernel && rm "$kernel_package"_*.deb)
  depmod -b "$share/kernel" "${kernel_package#linux-image-}"
  echo "$kernel_package" >"$cache/kernel-package"
fi
version=${kernel_package#linux-image-}

cp "$deb" "$share/prism.deb"
cp "$tools" "$share/prism-tools.deb"
cp "$here"/{guest.sh,deep.service,line_facts.py} "$here"/../{checks.sh,gyro.sh} "$share/"
sed 's/"rate_hz": 200/"rate_hz": 50/' "$source/config/frames/trplg.json" >"$share/frames.json"

# The initial file system: busybox and the kernel modules to mount the host's files.
mkdir -p "$work"/first/{bin,proc,sys,dev,lower,rw,system,"lib/modules/$version"}
cp "$(command -v busybox)" "$work/first/bin/"
cp "$here/init" "$work/first/"
modules=$share/kernel/lib/modules/$version
cp "$modules"/modules.{order,builtin,builtin.modinfo} "$work/first/lib/modules/$version/"
for module in virtio_pci 9pnet_virtio 9p overlay; do
  modprobe --dirname "$share/kernel" --set-version "$version" --show-depends "$module" | awk '$1 == "insmod" {print $2}'
done | sort -u | while read -r file; do install -D "$file" "$work/first${file#"$share/kernel"}"; done
depmod -b "$work/first" "$version"
(cd "$work/first" && find . | cpio --quiet -o -H newc) >"$work/first.cpio"

for n in 1 2 3; do
  "$prismsim" --link "$work/gyro$n" --frames "$share/frames.json" --profile steady >/dev/null 2>&1 & children+=($!)
  until [ -e "$work/gyro$n" ]; do sleep 0.05; done
done

lines=(-serial stdio)
lines+=(-chardev "serial,id=g1,path=$work/gyro1" -device isa-serial,chardev=g1,index=1)
lines+=(-chardev "serial,id=g2,path=$work/gyro2" -device pci-serial,chardev=g2)
lines+=(-chardev "serial,id=g3,path=$work/gyro3" -device qemu-xhci,id=xhci)
plug='{"execute": "device_add", "arguments": {"driver": "usb-serial", "id": "ftdi", "chardev": "g3", "serial": "GYRO0001", "bus": "xhci.0"}}'
unplug='{"execute": "device_del", "arguments": {"id": "ftdi"}}'
ask_machine() { { echo '{"execute": "qmp_capabilities"}'; echo "$1"; sleep 0.5; } | socat - "UNIX-CONNECT:$work/machine" >>"$work/machine.log"; }

good=1
while IFS= read -r text; do
  text=${text%$'\r'}
  case "$text" in
    *"HOST plug"*) ask_machine "$plug" ;;
    *"HOST unplug"*) ask_machine "$unplug" ;;
    *"GUEST good"*) good=0 ;;
  esac
  echo "$text"
done < <(timeout 570 qemu-system-x86_64 -accel tcg,thread=multi -machine q35 -cpu max -smp 2 -m 2048 -nodefaults -no-user-config \
  -display none -no-reboot -kernel "$share/kernel/boot/vmlinuz-$version" -initrd "$work/first.cpio" \
  -append "console=ttyS0 quiet panic=-1 rdinit=/init tsc=reliable mitigations=off fstab=no systemd.show_status=no systemd.unit=basic.target systemd.wants=deep.service systemd.mask=systemd-remount-fs.service" \
  -fsdev local,id=root,path=/,security_model=passthrough,readonly=on,multidevs=remap -device virtio-9p-pci,fsdev=root,mount_tag=root \
  -fsdev "local,id=deep,path=$share,security_model=passthrough,readonly=on" -device virtio-9p-pci,fsdev=deep,mount_tag=deep \
  -qmp "unix:$work/machine,server=on,wait=off" "${lines[@]}" 2>&1)
exit "$good"
