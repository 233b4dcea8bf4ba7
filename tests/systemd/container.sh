# SPDX-License-Identifier: MIT
# A real systemd on this machine's own tree: systemd-nspawn boots it under a throw-away overlay, whatever the host's PID 1.
#   container_up [NSPAWN OPTION...]    inside COMMAND...    container_down
# Needs root, systemd-container, overlayfs, and cgroup v2 mounted somewhere.
container=prism-test-$$
box=$(mktemp -d "${TMPDIR:-/tmp}/prism-systemd.XXXXXX")
cgroup=$(awk '$3 == "cgroup2" {print $2; exit}' /proc/mounts)/$container
nspawn=
leader=

# What keeps a container from running here, in one line; nothing where it can.
container_obstacle() {
  [ "$(id -u)" -eq 0 ] || { echo "not root"; return; }
  command -v systemd-nspawn >/dev/null || { echo "no systemd-nspawn: tools/setup installs it"; return; }
  grep -qw overlay /proc/filesystems || { echo "the kernel has no overlayfs"; return; }
  grep -q ' cgroup2 ' /proc/mounts || { echo "no cgroup v2 is mounted"; return; }
  (container_exec true) >"$box/trial.log" 2>&1 || echo "systemd-nspawn says: $(tail -1 "$box/trial.log")"
}

# Becomes systemd-nspawn, in a mount namespace where / is bound to a folder (nspawn refuses "/" itself) and /run is a tmpfs
# (nspawn cannot clean its folder there on a disk), and in a cgroup of its own: with --keep-unit nspawn makes payload/ below
# its caller's, where two runs would meet.
#   unified hierarchy: on a hybrid host the container would get read-only v1 controllers and no device filter
#   CAP_BPF, CAP_PERFMON, bpf(): without them systemd drops DevicePolicy= in silence
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
  # Not the host's own services: basic.target, and what the tests start.
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
  # The index of all manual pages would take ten seconds of every dpkg run.
  inside rm -f /var/lib/man-db/auto-update
  # A prismd that was started here by hand has left its log, which is not that of a dynamic user.
  inside rm -rf /var/log/prismd /var/log/private/prismd /var/lib/prismd /var/lib/private/prismd
  # Images made for containers forbid dpkg to start services; deb-systemd-invoke would do nothing.
  inside rm -f /usr/sbin/policy-rc.d
}

# By SIGKILL: there is nothing to keep, and an orderly poweroff takes tens of seconds. The cgroup v1 tree of systemd mirrors
# ours on a hybrid host.
container_down() {
  [ -z "$leader" ] || kill -KILL "$leader" 2>/dev/null || true
  [ -z "$nspawn" ] || { kill "$nspawn" 2>/dev/null || true; wait "$nspawn" 2>/dev/null || true; }
  find "$cgroup" "/sys/fs/cgroup/systemd/$container" -depth -type d -exec rmdir {} \; 2>/dev/null || true
  rmdir "$box/root" 2>/dev/null || true
  rm -rf --one-file-system "$box"
}
