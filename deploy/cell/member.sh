#!/bin/bash
# Sets up this computer's member of a cell's etcd, on Debian's etcd-server, and starts it (docs/cell.md). As root.
#   member.sh --cell CELL --name NAME --members NAME=ADDRESS,NAME=ADDRESS,NAME=ADDRESS [--replace]
# --name: which of them this computer is. --replace: it comes anew into a cell that runs, in the place of one that is lost.
# Before, the files of certificates.sh have to be in /etc/axisd/etcd: server.crt and server.key (etcd.NAME), peer.crt and
# peer.key (members/NAME), clients.crt and clients.crl (ca.crt, clients.crl), members.crt and members.crl (those of members/).
#   member.sh ... --print [--files DIR] [--data DIR]     only prints its configuration
set -euo pipefail

die() { echo "member.sh: $*" >&2; exit 1; }
usage() { sed -n '3,7s/^# \{0,3\}//p' "$(readlink -f "$0")" >&2; exit 2; }

cell='' name='' members='' state=new print='' files=/etc/axisd/etcd data=/var/lib/axisd-etcd
while [ $# -gt 0 ]; do
  case "$1" in
    --replace) state=existing; shift; continue ;;
    --print) print=1; shift; continue ;;
    --cell | --name | --members | --files | --data) [ $# -gt 1 ] || usage ;;
    *) usage ;;
  esac
  case "$1" in
    --cell) cell=$2 ;;
    --name) name=$2 ;;
    --members) members=$2 ;;
    --files) files=$2 ;;
    --data) data=$2 ;;
  esac
  shift 2
done
[ -n "$cell" ] && [ -n "$name" ] && [ -n "$members" ] || usage
for word in "$cell" "$name"; do
  [[ $word =~ ^[a-z][a-z0-9_-]{0,63}$ ]] || die "'$word' is no usable name: lower case letters, digits, dashes and underscores"
done

own='' cluster=''
IFS=, read -r -a all <<<"$members"
for member in "${all[@]}"; do
  [[ $member =~ ^[a-z][a-z0-9_-]*=[0-9]+(\.[0-9]+){3}$ ]] ||
    die "--members: '$member' is not of the form NAME=ADDRESS, with an IPv4 address"
  cluster+=,${member%%=*}=https://${member#*=}:2380
  [ "${member%%=*}" != "$name" ] || own=${member#*=}
done
[ -n "$own" ] || die "--members does not name $name"
case ${#all[@]} in
  1 | 3 | 5) ;;
  *) die "${#all[@]} members: take 3, or 5; an even number outlives no more losses than one less" ;;
esac

# Variables of etcd's environment, as its manual has them: with --config-file it would take no CRL. Its data is small: a key
# for each machine, of some kB. What is beyond the newest hour of changes is not kept. Its gateway for JSON stays closed: it
# knows no certificates' names.
configuration() {
  cat <<END
# Made by member.sh. Members: $members
ETCD_NAME=$name
ETCD_DATA_DIR=$data/data
ETCD_INITIAL_CLUSTER=${cluster#,}
ETCD_INITIAL_CLUSTER_TOKEN=axisd-$cell
ETCD_INITIAL_CLUSTER_STATE=$state
ETCD_LISTEN_PEER_URLS=https://$own:2380
ETCD_INITIAL_ADVERTISE_PEER_URLS=https://$own:2380
ETCD_LISTEN_CLIENT_URLS=https://$own:2379,https://127.0.0.1:2379
ETCD_ADVERTISE_CLIENT_URLS=https://$own:2379
ETCD_LISTEN_METRICS_URLS=http://127.0.0.1:2381
ETCD_CERT_FILE=$files/server.crt
ETCD_KEY_FILE=$files/server.key
ETCD_CLIENT_CERT_AUTH=true
ETCD_TRUSTED_CA_FILE=$files/clients.crt
ETCD_CLIENT_CRL_FILE=$files/clients.crl
ETCD_PEER_CERT_FILE=$files/peer.crt
ETCD_PEER_KEY_FILE=$files/peer.key
ETCD_PEER_CLIENT_CERT_AUTH=true
ETCD_PEER_TRUSTED_CA_FILE=$files/members.crt
ETCD_PEER_CRL_FILE=$files/members.crl
ETCD_ENABLE_GRPC_GATEWAY=false
ETCD_AUTO_COMPACTION_MODE=periodic
ETCD_AUTO_COMPACTION_RETENTION=1h
ETCD_QUOTA_BACKEND_BYTES=268435456
ETCD_SNAPSHOT_COUNT=10000
ETCD_LOGGER=zap
ETCD_LOG_OUTPUTS=stderr
ETCD_LOG_LEVEL=warn
END
}
if [ -n "$print" ]; then
  configuration
  exit
fi

[ "$(id -u)" -eq 0 ] || die "run this as root"
[ "$files" = /etc/axisd/etcd ] && [ "$data" = /var/lib/axisd-etcd ] || die "--files and --data are for --print"

# A memory card takes 50 ms and more for an fsync, now and then seconds, and wears out; one in RAM forgets.
install -d -m 700 "$data"
read -r source type < <(findmnt --noheadings --output SOURCE,FSTYPE --target "$data")
case "$type" in
  tmpfs | ramfs) die "$data is in memory: mount a disk there" ;;
  nfs* | cifs | 9p) die "$data is on another computer: mount a disk of this one there" ;;
esac
disk=$(lsblk --noheadings --inverse --list --output NAME "${source%%[*}" 2>/dev/null | tail -n 1) || disk=''
disk=${disk// /}
if [ -n "$disk" ] && [ "$(cat "/sys/block/$disk/device/type" 2>/dev/null)" = SD ]; then
  die "$data is on a memory card ($disk): mount a disk there, or give the member to another computer"
fi

# Debian's unit starts a single member that everybody on this computer may write to, at its installation.
[ "$(readlink /etc/systemd/system/etcd.service)" = /dev/null ] || systemctl mask --now etcd.service
if ! command -v etcd >/dev/null || ! command -v etcdctl >/dev/null; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends etcd-server etcd-client >/dev/null
fi

for file in server.crt server.key peer.crt peer.key clients.crt clients.crl members.crt members.crl; do
  [ -s "$files/$file" ] || die "$files/$file is missing: docs/cell.md says which file of certificates.sh it is"
done
chown root:etcd "$files" "$files"/*
chmod 750 "$files"
chmod 644 "$files"/*.cr?
chmod 640 "$files"/*.key
chown etcd:etcd "$data"
if [ "$state" = new ] && [ -d "$data/data/member" ]; then
  echo "member.sh: $data/data is there already: this member goes on with it"
fi
configuration >"$files/member.env.new"
mv "$files/member.env.new" "$files/member.env"
systemctl daemon-reload
systemctl enable axisd-etcd.service
# It is ready once most of the members are there; nobody waits for that here.
systemctl restart --no-block axisd-etcd.service
echo "member.sh: started; journalctl -u axisd-etcd -f shows when the other members are there"
