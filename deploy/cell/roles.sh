#!/bin/bash
# Who may write what in the etcd of a cell, by the names of certificates: each machine its own key, and the StopAll of the
# cell; everybody in it may read all (docs/cell.md). Once, when the members run, and again for each machine that is added.
#   roles.sh CELL MACHINE ...            gives the machines their rights; then switches the rights on
#   roles.sh --remove CELL MACHINE ...   takes rights and registrations of machines away
# With root's certificate, in the environment of etcdctl: ETCDCTL_ENDPOINTS=https://10.0.0.1:2379,...
# ETCDCTL_CACERT=ca.crt ETCDCTL_CERT=root.crt ETCDCTL_KEY=root.key
set -euo pipefail
export ETCDCTL_API=3

die() { echo "roles.sh: $*" >&2; exit 1; }
usage() { sed -n '4,7s/^# \{0,3\}//p' "$(readlink -f "$0")" >&2; exit 2; }

remove=''
if [ "${1:-}" = --remove ]; then remove=1; shift; fi
[ $# -ge 2 ] || usage
for name in "$@"; do
  [[ $name =~ ^[a-z][a-z0-9_-]{0,63}$ ]] || die "'$name' is no usable name: lower case letters, digits, dashes and underscores"
done
cell=$1
shift

# What etcd says where it is done already is no error.
already() {  # TEXT COMMAND...
  local text=$1 said
  shift
  said=$(etcdctl "$@" 2>&1) || grep -qF -- "$text" <<<"$said" || die "etcdctl $*: $(tail -n 1 <<<"$said")"
}
if [ -n "$remove" ]; then
  for machine in "$@"; do
    already "user name not found" user delete "cell.$machine"
    already "role name not found" role delete "machine.$machine"
    etcdctl del "/axisd/$cell/machines/$machine" >/dev/null
    etcdctl del --prefix "/axisd/$cell/machines/$machine/" >/dev/null
    echo "$machine: removed; revoke its certificate, too: pki.sh revoke cell.$machine"
  done
  exit
fi

already "user name already exists" user add root --no-password
already "role name already exists" role add root
already "role name already exists" role add "cell.$cell"
etcdctl role grant-permission "cell.$cell" read --prefix "/axisd/$cell/" >/dev/null
etcdctl role grant-permission "cell.$cell" readwrite "/axisd/$cell/stop_all" >/dev/null
etcdctl user grant-role root root >/dev/null
for machine in "$@"; do
  already "user name already exists" user add "cell.$machine" --no-password
  already "role name already exists" role add "machine.$machine"
  # Its key, and what is below it: a prefix alone would be that of press-10 as well.
  etcdctl role grant-permission "machine.$machine" readwrite "/axisd/$cell/machines/$machine" >/dev/null
  etcdctl role grant-permission "machine.$machine" readwrite --prefix "/axisd/$cell/machines/$machine/" >/dev/null
  etcdctl user grant-role "cell.$machine" "machine.$machine" >/dev/null
  etcdctl user grant-role "cell.$machine" "cell.$cell" >/dev/null
  echo "$machine: cell.$machine may write its registration, and the StopAll of $cell"
done
etcdctl auth enable >/dev/null
