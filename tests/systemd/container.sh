# SPDX-License-Identifier: MIT
# A real systemd on a copy of this machine: systemd-nspawn boots the root file system under a temporary overlay, whatever PID 1 the
# host has.
#   container_up [NSPAWN OPTION...]    inside COMMAND...    container_down
# Needs root, systemd-container, overlayfs, and cgroup v2 mounted somewhere.
container=prism-test-$$
box=$(mktemp -d "${TMPDIR:-/tmp}/prism-systemd.XXXXXX")
cgroup=$(awk '$3 == "cgroup2" {print $2; exit}' /proc/mounts)/$container
nspawn=
leader=

# Prints one line with the reason why no container can run here; prints nothing if one can.
container_obstacle() {
  [ "$(id -u)" -eq 0 ] || { echo "not root"; return; }
  command -v systemd-nspawn >/dev/null || { echo "no systemd-nspawn: tools/setup installs it"; return; }
  grep -qw overlay /proc/filesystems || { echo "the kernel has no overlayfs"; return; }
  grep -q ' cgroup2 ' /proc/mounts || { echo "no cgroup v2 is mounted"; return; }
  (container_exec true) >"$box/trial.log" 2>&1 || echo "systemd-nspawn failed: $(tail -1 "$box/trial.log")"
}

# Replaces the shell by systemd-nspawn. In its mount namespace, / is bound to a directory (nspawn rejects "/" itself) and /run is a
# tmpfs (nspawn cannot clean its directory there on a disk). It has a separate cgroup: with --keep-unit, nspawn creates payload/ in
# the cgroup of its caller, where two runs would collide.
#   unified hierarchy: on a hybrid host the container would get read-only v1 controllers and no device filter
#   CAP_BPF, CAP_PERFMON, bpf(): without them systemd ignores DevicePolicy= without a message
container_exec() {
  mkdir -p "$cgroup" "$box/root"
  echo 0 >"$cgroup/cgroup.procs"
  # shellcheck disable=SC2016
  exec setsid unshare --mount --propagation private sh -c '
    mount -t tmpfs -o mode=755 tmpfs /run && mount --bind / "$1" && shift && exec "$@"' sh "$box/root" \
    env SYSTEMD_NSPAWN_UNIFIED_HIERARCHY=1 systemd-nspawn --quiet --directory="$box/root" --volatile=overlay \
    --machine="$container" --register=no --keep-unit --private-network --resolv-conf=off --timezone=off --link-journal=no \
    --console=pipe --capability=CAP_BPF,CAP_PERFMON --system-call-filter=bpf "$@" </dev/null
}

inside() { nsenter --target "$leader" --all --root --wd -- "$@"; }

container_up() {
  local state='' tries
  # Boots to basic.target only, so that the host's services do not run.
  (container_exec --boot "$@" systemd.unit=basic.target) >"$box/console.log" 2>&1 &
  nspawn=$!
  for ((tries = 0; tries < 600; tries++)); do
    [ -n "$leader" ] || leader=$(pgrep -P "$nspawn" -x systemd || true)
    [ -z "$leader" ] || state=$(inside systemctl is-system-running 2>/dev/null || true)
    case "$state" in running | degraded) break ;; esac
    kill -0 "$nspawn" 2>/dev/null || break
    sleep 0.05
  done
  case "$state" in
    running | degraded) ;;
    *) cat "$box/console.log"; echo "the container did not boot: found state '$state', expected running" >&2; return 1 ;;
  esac
  # Without this, each dpkg run would spend ten seconds on the index of manual pages.
  inside rm -f /var/lib/man-db/auto-update
  # Logs of a prismd that was started manually on this machine; a dynamic user cannot use their directories.
  inside rm -rf /var/log/prismd /var/log/private/prismd /var/lib/prismd /var/lib/private/prismd
  # Container images forbid dpkg to start services with this file; deb-systemd-invoke would have no effect.
  inside rm -f /usr/sbin/policy-rc.d
}

# Uses SIGKILL, because an orderly poweroff takes tens of seconds and the overlay is discarded. On a hybrid host, systemd's cgroup v1
# tree has the same directory as ours.
container_down() {
  [ -z "$leader" ] || kill -KILL "$leader" 2>/dev/null || true
  [ -z "$nspawn" ] || { kill "$nspawn" 2>/dev/null || true; wait "$nspawn" 2>/dev/null || true; }
  find "$cgroup" "/sys/fs/cgroup/systemd/$container" -depth -type d -exec rmdir {} \; 2>/dev/null || true
  rmdir "$box/root" 2>/dev/null || true
  rm -rf --one-file-system "$box"
}
