#!/bin/bash
# A small certificate authority for a machine or a cell: whom the daemons and their clients trust (docs/tls.md).
# Whoever has its folder can make a client with any name: keep it on a computer that is no machine's.
#   deploy/pki.sh init [NAME]            a new authority; NAME: what it is called (default: axisd)
#   deploy/pki.sh server NAME HOST...    a daemon's pair; HOST: each name and address by which clients call it
#   deploy/pki.sh client NAME [SHOWN]    a client's pair; NAME: by which `access:` knows it, or SHOWN, which several may show
#   deploy/pki.sh peer NAME HOST...      a pair for both ends: a member of etcd among the others (docs/cell.md)
#   deploy/pki.sh renew NAME             a new pair in the place of the old one, which stays valid until it ends
#   deploy/pki.sh revoke NAME            takes back all that it has, and writes the CRL
#   deploy/pki.sh crl                    writes the CRL anew, before it is out of date
#   deploy/pki.sh list                   what there is, until when
# Before these words: --dir DIR (default: $AXISD_PKI, else ./axisd-pki), --days N (default: 365; of init: 3650).
set -euo pipefail
umask 077

die() { echo "pki.sh: $*" >&2; exit 1; }
usage() { sed -n '4,12s/^# \{0,3\}//p' "$(readlink -f "$0")" >&2; exit 2; }

dir=${AXISD_PKI:-axisd-pki}
days=''
while [ $# -gt 0 ]; do
  case "$1" in
    --dir) [ $# -gt 1 ] || usage; dir=$2; shift 2 ;;
    --days)
      [ $# -gt 1 ] || usage
      [[ $2 =~ ^[1-9][0-9]{0,4}$ ]] || die "--days $2: give 1 to 99999"
      days=$2
      shift 2
      ;;
    -*) usage ;;
    *) break ;;
  esac
done
[ $# -gt 0 ] || usage
command=$1
shift

# Names are in file names, subjects and configurations.
check_name() {
  [[ $1 =~ ^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$ ]] ||
    die "'$1' is no usable name: 1 to 64 letters, digits, dots, dashes and underscores"
}
quietly() {  # openssl tells much where all is well
  local said
  said=$("$@" 2>&1) || die "$(head -n 3 <<<"$said")"
}
authority() {
  [ -s "$dir/ca.key" ] || die "$dir: no authority is there; make one: pki.sh --dir $dir init"
  dir=$(readlink -f "$dir")
  exec 9>>"$dir/lock"
  flock -w 10 9 || die "$dir: somebody else is at work there"
  write_configuration  # the folder may have been moved
}
end_of() { date -u -d "$(openssl x509 -in "$1" -noout -enddate | cut -d= -f2)" +%Y-%m-%d; }

write_configuration() {
  [[ $dir != *['$"\\#']* ]] || die "$dir: openssl does not take such a path"
  cat >"$dir/openssl.cnf" <<END
[ca]
default_ca = own
[own]
database = $dir/index.txt
new_certs_dir = $dir/certs
certificate = $dir/ca.crt
private_key = $dir/ca.key
crlnumber = $dir/crlnumber
rand_serial = yes
unique_subject = no
default_md = sha256
policy = any
copy_extensions = none
crl_extensions = of_crl
[any]
commonName = supplied
organizationalUnitName = optional
[of_crl]
authorityKeyIdentifier = keyid
[req]
distinguished_name = dn
[dn]
[of_ca]
basicConstraints = critical,CA:TRUE,pathlen:0
keyUsage = critical,keyCertSign,cRLSign
subjectKeyIdentifier = hash
END
}

write_crl() {
  quietly openssl ca -config "$dir/openssl.cnf" -gencrl -crldays "${days:-365}" -out "$dir/clients.crl.new"
  chmod 644 "$dir/clients.crl.new"
  mv "$dir/clients.crl.new" "$dir/clients.crl"
}

make_key() { quietly openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:prime256v1 -out "$1"; }

# What NAME.ext says; before there was anything to say, its name alone.
subject_of() {  # NAME
  local said
  said=$(sed -n 's/^# subject: //p' "$dir/$1.ext" 2>/dev/null) || true
  echo "${said:-/CN=$1}"
}

# Signs what NAME.ext asks for. The pair takes its place when both parts are there, the key first: a daemon that reads
# between the two keeps what it has.
issue() {  # NAME
  local base=$dir/$1
  make_key "$base.key.new"
  quietly openssl req -new -config "$dir/openssl.cnf" -key "$base.key.new" -subj "$(subject_of "$1")" -out "$base.csr"
  quietly openssl ca -config "$dir/openssl.cnf" -batch -notext -days "${days:-365}" -extfile "$base.ext" \
    -in "$base.csr" -out "$base.crt.new"
  chmod 644 "$base.crt.new"
  rm "$base.csr"
  mv "$base.key.new" "$base.key"
  mv "$base.crt.new" "$base.crt"
  echo "$base.crt and .key: valid until $(end_of "$base.crt")"
}

new_pair() {  # NAME USAGE [SAN [SHOWN]]
  check_name "$1"
  [ ! -e "$dir/$1.crt" ] || die "$1 is there already: renew it, or choose another name"
  [ "$1" != ca ] || die "ca is the authority itself: choose another name"
  printf 'basicConstraints = critical,CA:FALSE\nkeyUsage = critical,digitalSignature\nextendedKeyUsage = %s\n' \
    "$2" >"$dir/$1.ext"
  printf 'subjectKeyIdentifier = hash\nauthorityKeyIdentifier = keyid\n' >>"$dir/$1.ext"
  [ -z "${3:-}" ] || echo "subjectAltName = $3" >>"$dir/$1.ext"
  [ -z "${4:-}" ] || echo "# subject: /CN=$4/OU=$1" >>"$dir/$1.ext"
  issue "$1"
}

alternatives() {  # HOST... -> DNS:...,IP:...
  local host all=''
  for host in "$@"; do
    if [[ $host =~ ^[0-9]+(\.[0-9]+){3}$ || $host == *:*:* ]]; then
      [[ $host =~ ^[0-9A-Fa-f.:]+$ ]] || die "'$host' is no address"
      all+=,IP:$host
    else
      [[ $host =~ ^[A-Za-z0-9]([A-Za-z0-9.-]*[A-Za-z0-9])?$ ]] || die "'$host' is no name of a host; give it without a port"
      all+=,DNS:$host
    fi
  done
  echo "${all#,}"
}

case "$command" in
  init)
    [ $# -le 1 ] || usage
    name=${1:-axisd}
    check_name "$name"
    [ ! -e "$dir/ca.key" ] || die "$dir: an authority is there already"
    mkdir -p "$dir/certs"
    dir=$(readlink -f "$dir")
    write_configuration
    : >"$dir/index.txt"
    echo 01 >"$dir/crlnumber"
    make_key "$dir/ca.key"
    quietly openssl req -x509 -config "$dir/openssl.cnf" -extensions of_ca -key "$dir/ca.key" -subj "/CN=$name" \
      -days "${days:-3650}" -out "$dir/ca.crt"
    chmod 644 "$dir/ca.crt"
    days=''
    write_crl
    echo "$dir/ca.crt: the authority $name, valid until $(end_of "$dir/ca.crt"); nobody is revoked by $dir/clients.crl"
    ;;
  server)
    [ $# -ne 1 ] || die "server $1: give its HOST, each name and address by which clients call it"
    [ $# -ge 2 ] || usage
    authority
    hosts=$(alternatives "${@:2}")
    new_pair "$1" serverAuth "$hosts"
    ;;
  peer)
    [ $# -ne 1 ] || die "peer $1: give its HOST, each name and address by which others call it"
    [ $# -ge 2 ] || usage
    authority
    hosts=$(alternatives "${@:2}")
    new_pair "$1" serverAuth,clientAuth "$hosts"
    ;;
  client)
    [ $# -eq 1 ] || [ $# -eq 2 ] || usage
    authority
    [ $# -eq 1 ] || check_name "$2"
    new_pair "$1" clientAuth '' "${2:-}"
    ;;
  renew)
    [ $# -eq 1 ] || usage
    authority
    check_name "$1"
    [ -s "$dir/$1.crt" ] || die "$1 is not known here; pki.sh list shows who is"
    issue "$1"
    ;;
  revoke)
    [ $# -eq 1 ] || usage
    authority
    check_name "$1"
    count=0 own=$(subject_of "$1")
    # A renewed certificate does not end the one before.
    while IFS=$'\t' read -r state _ _ serial _ subject; do
      [ "$state" = V ] && [ "$subject" = "$own" ] || continue
      quietly openssl ca -config "$dir/openssl.cnf" -revoke "$dir/certs/$serial.pem"
      count=$((count + 1))
    done < <(sed 's/\t\t/\t-\t/' "$dir/index.txt")
    [ "$count" -gt 0 ] || die "$1 has nothing that could be revoked; pki.sh list shows what there is"
    write_crl
    rm -f "$dir/$1.crt" "$dir/$1.key" "$dir/$1.ext"
    echo "$1: $count revoked; install $dir/clients.crl at each daemon, which reads it by itself"
    ;;
  crl)
    [ $# -eq 0 ] || usage
    authority
    write_crl
    echo "$dir/clients.crl: valid for ${days:-365} days"
    ;;
  list)
    [ $# -eq 0 ] || usage
    authority
    quietly openssl ca -config "$dir/openssl.cnf" -updatedb
    while IFS=$'\t' read -r state ends _ serial _ subject; do
      case "$state" in
        V) state=valid ;;
        R) state=revoked ;;
        E) state=expired ;;
      esac
      subject=${subject#/CN=}
      printf '%-8s until 20%s-%s-%s  %s  %s\n' "$state" "${ends:0:2}" "${ends:2:2}" "${ends:4:2}" "${subject/\/OU=/ as }" "$serial"
    done < <(sed 's/\t\t/\t-\t/' "$dir/index.txt")
    ;;
  *) usage ;;
esac
