#!/bin/bash
# The init process of the guest (see run.sh): brings up SocketCAN, runs $GUEST_JOB/command, powers off.
[ "$$" = 1 ] && [ -n "${GUEST_JOB:-}" ] || { echo "init.sh: run by run.sh only" >&2; exit 2; }
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mkdir -p /dev/pts /dev/shm
mount -t devpts -o ptmxmode=666 devpts /dev/pts
mount -t tmpfs tmpfs /dev/shm
mount -t tmpfs tmpfs /run
ln -sf /proc/self/fd /dev/fd
ln -sf fd/0 /dev/stdin
ln -sf fd/1 /dev/stdout
ln -sf fd/2 /dev/stderr

# finit_module(2) and reboot(2) by number: kmod is not among the packages, and would search for modules elsewhere.
cd "/usr/lib/uml/modules/$(uname -r)/kernel" &&
  perl -e '$none = ""; for (@ARGV) {
             open $file, "<", "$_.ko" and syscall(313, fileno $file, $none, 0) == 0 or warn "insmod $_: $!\n" }' \
    drivers/net/can/dev/can-dev net/can/can net/can/can-raw net/can/can-bcm net/can/can-gw \
    drivers/net/can/vcan drivers/net/can/vxcan drivers/net/can/slcan/slcan
hostname guest
printf '%s\n' 'link set lo up' 'link add vcan0 type vcan' 'link set vcan0 up' 'link add vcan1 type vcan' \
  'link set vcan1 up' | ip -batch -

if [ -e /sys/class/net/vcan1 ]; then
  setsid -w timeout -k 5 "$GUEST_LIMIT" bash "$GUEST_JOB/command" </dev/null >"$GUEST_JOB/output" 2>&1
  echo $? >"$GUEST_JOB/status"
  sync
fi
exec perl -e 'syscall(169, 0xfee1dead, 672274793, 0x4321fedc, 0)'
