#!/bin/bash
# Makes every certificate of a cell, by pki.sh; what is there already stays as it is, so that machines can be added later.
# Whoever has its folder can be anybody in the cell: keep it on a computer that is no machine's (docs/cell.md).
#   certificates.sh [--dir DIR] [--members NAME,NAME,NAME] CELL MACHINE=HOST[,HOST...] ...
# CELL: name of the cell. MACHINE: as its axisd calls itself; HOST: each name and address by which it is called.
# --members: those that have a member of etcd each, other computers as well (default: the first three, where there is no member
# yet); '': none.
# --dir: folder of the authority (default: $AXISD_PKI, else ./axisd-pki).
# In the folder then, for each machine:
#   MACHINE.{crt,key}          what its axisd and its axisd-cell show to those that call them
#   entrance.MACHINE.{crt,key} what its axisd-cell shows to daemons and other entrances: the name cell.CELL, all of them the
#                              same, so that a request that is repeated through another entrance is the same request
#   cell.MACHINE.{crt,key}     what its axisd-cell shows to etcd, where each machine writes what is its own
# for each member of etcd:
#   etcd.NAME.{crt,key}        what it shows to those that call it
#   members/NAME.{crt,key}     what it shows to the other members; these have an authority of their own, members/ca.crt
# and root.{crt,key}, the administrator of etcd.
set -euo pipefail

die() { echo "certificates.sh: $*" >&2; exit 1; }
usage() { sed -n '4,8s/^# \{0,3\}//p' "$(readlink -f "$0")" >&2; exit 2; }

here=$(dirname "$(readlink -f "$0")")
dir=${AXISD_PKI:-axisd-pki} members='' chosen=''
while [ $# -gt 0 ]; do
  case "$1" in
    --dir) [ $# -gt 1 ] || usage; dir=$2; shift 2 ;;
    --members) [ $# -gt 1 ] || usage; chosen=1 members=$2; shift 2 ;;
    -*) usage ;;
    *) break ;;
  esac
done
[ $# -ge 2 ] || usage
cell=$1
shift

declare -A hosts=()
names=()
[[ $cell =~ ^[a-z][a-z0-9_-]*$ ]] || die "'$cell' is no usable name of a cell: lower case letters, digits, dashes, underscores"
for word in "$@"; do
  [[ $word =~ ^[a-z][a-z0-9_-]*=. ]] || die "'$word' is not of the form MACHINE=HOST[,HOST...]"
  # Else the name that its machine shows to etcd would be that of all entrances.
  [ "${word%%=*}" != "$cell" ] || die "the cell and a machine are called '$cell': give one of them another name"
  hosts[${word%%=*}]=${word#*=}
  names+=("${word%%=*}")
done
# A machine that is added has no member of etcd, unless that is said.
[ -n "$chosen" ] || [ -e "$dir/members/ca.key" ] || members=$(IFS=,; echo "${names[*]:0:3}")
IFS=, read -r -a member_names <<<"$members"
for name in "${member_names[@]}"; do
  [ -n "${hosts[$name]:-}" ] || die "--members names $name: tell its hosts as well ($name=HOST)"
done

[ -x "$here/../pki.sh" ] || die "$here/../pki.sh is missing: it comes with the package axisd"
pki() { "$here/../pki.sh" --dir "$1" "${@:2}"; }
once() {  # DIR KIND NAME [WORD...]
  [ -e "$1/$3.crt" ] || pki "$@"
}
[ -e "$dir/ca.key" ] || pki "$dir" init "$cell"
[ -z "$members" ] || [ -e "$dir/members/ca.key" ] || pki "$dir/members" init "$cell-members"
[ -z "$members" ] || once "$dir" client root

for name in "${names[@]}"; do
  IFS=, read -r -a own <<<"${hosts[$name]}"
  once "$dir" server "$name" "${own[@]}" localhost 127.0.0.1
  once "$dir" client "entrance.$name" "cell.$cell"
  once "$dir" client "cell.$name"
done
for name in "${member_names[@]}"; do
  IFS=, read -r -a own <<<"${hosts[$name]}"
  once "$dir" server "etcd.$name" "${own[@]}" localhost 127.0.0.1
  once "$dir/members" peer "$name" "${own[@]}"
done
