#!/bin/bash
# A whole cell on one computer: machines with simulated drives and members of etcd, each in a network namespace of its
# own, as on computers of their own. As root; needs iproute2, etcd-server and etcd-client. Ctrl-C ends all of it.
#   demo.sh [--machines N] [--members N] [--axes N] [--dir DIR] [--once]
#   demo.sh ... --prepare DIR      only makes namespaces, certificates and configurations, and starts nothing
#   demo.sh --remove DIR           takes away the namespaces that --prepare made
# --machines: 1 to 100 (default: 3); the first --members of them (default: 3; 0: no etcd) have a member of etcd. --axes: of
# each machine (default: 2). --dir: keeps everything there. --once: shows the cell once, and ends.
# AXISD, AXISD_CELL and AXISCTL name the programs; else those of build/release, else the installed ones.
# In DIR, for each computer: NAME/in COMMAND runs a command on it; NAME/{etcd,axisd,cell}.run start what it has. The
# computer desk is that of the person shift-a, who is a maintainer.
set -euo pipefail

die() { echo "demo.sh: $*" >&2; exit 1; }
usage() { sed -n '4,6s/^# \{0,3\}//p' "$(readlink -f "$0")" >&2; exit 2; }
say() { printf '\n== %s\n' "$*"; }

here=$(dirname "$(readlink -f "$0")")
clone=$(readlink -f "$here/../..")
machines=3 members=3 axes=2 dir='' once='' prepare='' remove=''
number() { if ! [[ $2 =~ ^[0-9]{1,3}$ ]] || [ "$2" -lt "$3" ] || [ "$2" -gt "$4" ]; then die "$1 $2: give $3 to $4"; fi; }
while [ $# -gt 0 ]; do
  case "$1" in
    --once) once=1; shift; continue ;;
    --machines | --members | --axes | --dir | --prepare | --remove) [ $# -gt 1 ] || usage ;;
    *) usage ;;
  esac
  case "$1" in
    --machines) number "$1" "$2" 1 100; machines=$2 ;;
    --members) number "$1" "$2" 0 5; members=$2 ;;
    --axes) number "$1" "$2" 1 32; axes=$2 ;;
    --dir) dir=$2 ;;
    --prepare) prepare=1 dir=$2 ;;
    --remove) remove=1 dir=$2 ;;
  esac
  shift 2
done
[ "$(id -u)" -eq 0 ] || die "run this as root: it makes network namespaces"

take_away() {  # the namespaces of DIR, and what runs in them
  local name
  while read -r name; do
    # shellcheck disable=SC2046  # a list of numbers
    kill -KILL $(ip netns pids "$name" 2>/dev/null) 2>/dev/null || true
    ip netns del "$name" 2>/dev/null || true
  done <"$dir/namespaces"
}
if [ -n "$remove" ]; then
  [ -s "$dir/namespaces" ] || die "$dir is none that --prepare made"
  take_away
  exit
fi

program() {  # VARIABLE NAME PLACE
  local found=${!1:-}
  [ -n "$found" ] || found=$clone/build/release/$3
  [ -x "$found" ] || found=$(command -v "$2") || die "no $2: build it (cmake --build --preset release), or name it in $1"
  readlink -f "$found"
}
axisd=$(program AXISD axisd daemon/axisd)
axisctl=$(program AXISCTL axisctl api/axisctl/axisctl)
axisd_cell=$(program AXISD_CELL axisd-cell api/cell/axisd-cell)
if [ "$members" -gt 0 ]; then
  { command -v etcd && command -v etcdctl; } >/dev/null || die "no etcd: install etcd-server and etcd-client, etcd.service masked"
fi

made=''
[ -n "$dir" ] || made=1 dir=$(mktemp -d "${TMPDIR:-/tmp}/axisd-cell.XXXXXX")
mkdir -p "$dir"
dir=$(readlink -f "$dir")
[ ! -e "$dir/namespaces" ] || die "$dir is in use, or was used: give an empty folder"
prefix=axisd-$$
cell=demo
names=()
for ((i = 1; i <= machines; i++)); do names+=("press-$i"); done
[ "$members" -le "$machines" ] || die "--members $members, and only $machines machines to have them"
member_names=("${names[@]:0:members}")
declare -A address=([desk]=10.28.0.2)
for ((i = 1; i <= machines; i++)); do address[press-$i]=10.28.0.$((10 + i)); done

pids=()
clean_up() {
  local status=$? pid
  trap '' INT TERM
  for pid in "${pids[@]}"; do kill -TERM "$pid" 2>/dev/null || true; done
  for _ in $(seq 100); do
    jobs -rp | grep -q . || break
    sleep 0.1
  done
  [ ! -e "$dir/namespaces" ] || take_away
  if [ "$status" -ne 0 ] && [ -n "$made" ]; then tail -n 5 "$dir"/*/*.log >&2 2>/dev/null || true; fi
  [ -z "$made" ] || rm -rf "$dir"
  exit "$status"
}
if [ -z "$prepare" ]; then
  trap clean_up EXIT
  trap 'exit 130' INT
  trap 'exit 143' TERM
fi

# A switch, and a cable from it to each computer.
make_network() {
  local name
  for name in wire desk "${names[@]}"; do echo "$prefix-$name" >>"$dir/namespaces"; done
  ip netns add "$prefix-wire"
  ip -n "$prefix-wire" link add switch type bridge
  ip -n "$prefix-wire" link set switch up
  for name in desk "${names[@]}"; do
    ip netns add "$prefix-$name"
    ip -n "$prefix-wire" link add "$name" type veth peer name eth0 netns "$prefix-$name"
    ip -n "$prefix-wire" link set "$name" master switch up
    ip -n "$prefix-$name" link set lo up
    ip -n "$prefix-$name" link set eth0 up
    ip -n "$prefix-$name" address add "${address[$name]}/24" dev eth0
  done
}

# A computer has its own name, its own machine-id, and the same hosts as all.
make_computer() {  # NAME
  local own=$dir/$1
  mkdir -p "$own"
  md5sum <<<"$prefix-$1" | cut -c 1-32 >"$own/machine-id"
  cat >"$own/in" <<END
#!/bin/bash
exec nsenter --net=/run/netns/$prefix-$1 unshare --mount --uts bash -c '
  hostname $1
  mount --bind "$dir/hosts" /etc/hosts
  if [ -e /etc/machine-id ]; then mount --bind "$own/machine-id" /etc/machine-id; fi
  exec "\$@"' in "\$@"
END
  chmod +x "$own/in"
}
run_file() {  # NAME PROGRAM COMMAND...
  printf '#!/bin/bash\nexec %q %s "$@"\n' "$dir/$1/in" "${*:3}" >"$dir/$1/$2.run"
  chmod +x "$dir/$1/$2.run"
}
copy() {  # FROM TO
  install -m 600 "$dir/pki/$1" "$2"
}

make_member() {  # NAME
  local own=$dir/$1/etcd list='' name
  mkdir -p "$own/disk"
  for name in "${member_names[@]}"; do list+=,$name=${address[$name]}; done
  for end in crt key; do
    copy "etcd.$1.$end" "$own/server.$end"
    copy "members/$1.$end" "$own/peer.$end"
  done
  copy ca.crt "$own/clients.crt"
  copy clients.crl "$own/clients.crl"
  copy members/ca.crt "$own/members.crt"
  copy members/clients.crl "$own/members.crl"
  "$here/member.sh" --cell "$cell" --name "$1" --members "${list#,}" --print --files "$own" --data "$own/disk" >"$own/member.env"
  # shellcheck disable=SC2016  # it is expanded there
  run_file "$1" etcd bash -c "'set -a; . \"\$0\"; exec etcd \"\$@\"'" "$own/member.env"
}

make_axisd() {  # NAME
  local own=$dir/$1
  {
    cat <<END
machine: $1
state_directory: $own/state
server:
  listen: 0.0.0.0:7443
  tls: { certificate: $own/server.crt, key: $own/server.key, client_ca: $own/ca.crt, crl: $own/clients.crl }
  metrics: { listen: 0.0.0.0:9464, remote: true }
access:
  roles: { shift-a: maintainer, cell.$cell: viewer }
  delegates: { cell.$cell: maintainer }
buses:
  line-a: { modbus_rtu: { port: sim, baud: 115200, turnaround_max: 200 ms } }
axes:
END
    for ((axis = 1; axis <= axes; axis++)); do
      cat <<END
  spindle-$axis:
    bus: line-a
    node: $axis
    model: ykd2405pr
    unit: mm
    scale: { microstep: 10000 pulses/rev, travel: 5 mm/rev }
    limits: { position: [-500, 500], velocity: 100 mm/s, acceleration_time: 150 ms }
END
    done
  } >"$own/axisd.yaml"
  run_file "$1" axisd "$axisd" --config "$own/axisd.yaml"
}

make_entrance() {  # NAME
  local own=$dir/$1 name endpoints=''
  {
    cat <<END
cell: $cell
machine: $1
listen: 0.0.0.0:7445
advertise: ${address[$1]}:7445
tls: { certificate: $own/server.crt, key: $own/server.key, client_ca: $own/ca.crt, crl: $own/clients.crl }
axisd:
  server: 127.0.0.1:7443
  stop_server: 127.0.0.1:7444
  advertise: ${address[$1]}:7443
  stop_advertise: ${address[$1]}:7444
  tls: { ca: $own/ca.crt, certificate: $own/entrance.crt, key: $own/entrance.key }
state: $own/cell
metrics: { listen: 0.0.0.0:9465 }
roles: { shift-a: maintainer }
END
    if [ "$members" -gt 0 ]; then
      for name in "${member_names[@]}"; do endpoints+=", ${address[$name]}:2379"; done
      cat <<END
etcd:
  endpoints: [ ${endpoints#, } ]
  tls: { ca: $own/ca.crt, certificate: $own/cell.crt, key: $own/cell.key }
END
    else
      echo "peers:"
      for name in "${names[@]}"; do
        [ "$name" = "$1" ] ||
          echo "  $name: { axisd: ${address[$name]}:7443, stop: ${address[$name]}:7444, cell: ${address[$name]}:7445 }"
      done
    fi
  } >"$own/cell.yaml"
  mkdir -p "$own/cell"
  run_file "$1" cell "$axisd_cell" --config "$own/cell.yaml"
}

prepare_all() {
  local name hosts=() all=''
  for name in "${names[@]}"; do hosts+=("$name=$name,${address[$name]}"); done
  all=$(IFS=,; echo "${member_names[*]}")
  "$here/certificates.sh" --dir "$dir/pki" --members "$all" "$cell" "${hosts[@]}" >"$dir/pki.log"
  "$here/../pki.sh" --dir "$dir/pki" client shift-a >>"$dir/pki.log"
  make_network
  { echo "127.0.0.1 localhost"; for name in desk "${names[@]}"; do echo "${address[$name]} $name"; done; } >"$dir/hosts"
  for name in desk "${names[@]}"; do make_computer "$name"; done
  for name in "${member_names[@]}"; do make_member "$name"; done
  for name in "${names[@]}"; do
    for end in crt key; do
      copy "$name.$end" "$dir/$name/server.$end"
      copy "entrance.$name.$end" "$dir/$name/entrance.$end"
      copy "cell.$name.$end" "$dir/$name/cell.$end"
    done
    copy ca.crt "$dir/$name/ca.crt"
    copy clients.crl "$dir/$name/clients.crl"
    make_axisd "$name"
    make_entrance "$name"
  done
  cat >"$dir/desk/env" <<END
export PATH=$(dirname "$axisctl"):\$PATH
export AXISD_CELL=press-1 AXISD_TLS_CA=$dir/pki/ca.crt AXISD_TLS_CERT=$dir/pki/shift-a.crt AXISD_TLS_KEY=$dir/pki/shift-a.key
export ETCDCTL_ENDPOINTS=$(for name in "${member_names[@]}"; do printf 'https://%s:2379,' "${address[$name]}"; done | sed 's/,$//')
export ETCDCTL_CACERT=$dir/pki/ca.crt ETCDCTL_CERT=$dir/pki/root.crt ETCDCTL_KEY=$dir/pki/root.key
END
  # shellcheck disable=SC2016  # it is expanded there
  run_file desk shell bash -c "'. \"\$0\"; exec \"\$@\"'" "$dir/desk/env"
}

prepare_all
if [ -n "$prepare" ]; then
  echo "$dir: prepared, in the namespaces $prefix-*"
  exit
fi

start() {  # NAME PROGRAM
  "$dir/$1/$2.run" >"$dir/$1/$2.log" 2>&1 &
  pids+=($!)
}
desk() { "$dir/desk/shell.run" "$@"; }
eventually() {
  local pid
  for _ in $(seq 300); do
    desk "$@" >"$dir/last" 2>&1 && return 0
    for pid in "${pids[@]}"; do kill -0 "$pid" 2>/dev/null || die "something ended by itself; its log is in $dir"; done
    sleep 0.2
  done
  cat "$dir/last" >&2
  die "did not succeed within its time: $*"
}

if [ "$members" -gt 0 ]; then
  say "etcd: $members members, and who may write what"
  for name in "${member_names[@]}"; do start "$name" etcd; done
  eventually etcdctl endpoint health
  desk "$here/roles.sh" "$cell" "${names[@]}"
fi
say "$machines machines with $axes simulated axes each"
for name in "${names[@]}"; do start "$name" axisd; done
for name in "${names[@]}"; do eventually axisctl --server "$name:7443" list; done
say "their entrances"
for name in "${names[@]}"; do start "$name" cell; done
step() {  # shows a command as it would be typed, and runs it
  echo "\$ $*"
  desk "$@" || die "failed: $*"
}
present() { [ "$(desk axisctl --json --cell "$1" machines 2>"$dir/last" | grep -o MACHINE_STATE_PRESENT | wc -l)" -eq "$machines" ]; }
for name in "${names[@]}"; do
  for ((i = 1; i <= 150; i++)); do
    present "$name" && break
    [ "$i" -lt 150 ] || die "the entrance of $name does not see all machines: $(cat "$dir/last")"
    sleep 0.2
  done
done
step axisctl machines
step axisctl list
far=${names[-1]}
step axisctl enable "$far/spindle-1" --wait
step axisctl set-position "$far/spindle-1" 0mm --wait
step axisctl move "$far/spindle-1" 20mm --relative --velocity 40mm/s --wait
step axisctl stop --all
step axisctl release-stop --all

if [ -z "$once" ]; then
  cat <<END

The cell runs until Ctrl-C. To command it from another terminal, as shift-a at a computer beside the machines:
  $dir/desk/shell.run bash
  axisctl machines --watch                                # which there are, by the entrance of press-1
  axisctl move press-2/spindle-2 20mm --relative --wait   # once it is enabled
  etcdctl get --prefix /axisd/ --keys-only                # who is registered
To cut off a machine, and to join it again:
  ip -n $prefix-wire link set press-2 nomaster
  ip -n $prefix-wire link set press-2 master switch
Logs and configurations are in $dir.
END
  wait "${pids[@]}" || true
  die "everything ended by itself"
fi
say "Ending"
