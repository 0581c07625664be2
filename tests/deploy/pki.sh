#!/bin/bash
# What deploy/pki.sh makes, as openssl judges it.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."

die() { echo "pki.sh: $*" >&2; exit 1; }
scratch=$(mktemp -d "${TMPDIR:-/tmp}/axisd-pki.XXXXXX")
trap 'rm -rf "$scratch"' EXIT
pki() { deploy/pki.sh --dir "$scratch/cell" "$@"; }
refused() {  # TEXT WORD...
  local expected=$1 said
  shift
  ! said=$(pki "$@" 2>&1) || die "$* was done"
  grep -qF -- "$expected" <<<"$said" || die "$*: $said"
}
verify() { openssl verify -x509_strict -CAfile "$scratch/cell/ca.crt" "$@" >/dev/null 2>&1; }
good() { verify -purpose "$1" -crl_check -CRLfile "$scratch/cell/clients.crl" "$2" || die "$2 is not good for $1"; }
revoked() { ! verify -crl_check -CRLfile "$scratch/cell/clients.crl" "$1" || die "$1 is not revoked"; }
mode() { [ "$(stat -c %a "$scratch/cell/$1")" = "$2" ] || die "$1 has mode $(stat -c %a "$scratch/cell/$1")"; }

refused "no authority is there" client shift-a
pki init cell-1 >/dev/null
refused "an authority is there already" init
pki server press-1 press-1.local 10.0.0.5 ::1 >/dev/null
pki client shift-a >/dev/null
pki client panel >/dev/null
pki peer etcd-1 10.0.0.1 >/dev/null
cell=$scratch/cell
good sslserver "$cell/press-1.crt"
good sslclient "$cell/shift-a.crt"
good sslserver "$cell/etcd-1.crt"
good sslclient "$cell/etcd-1.crt"
verify -verify_ip 10.0.0.1 "$cell/etcd-1.crt" || die "not for 10.0.0.1"
! verify -purpose sslclient "$cell/press-1.crt" || die "the daemon's certificate is good for a client"
! verify -purpose sslserver "$cell/shift-a.crt" || die "a client's certificate is good for a daemon"
verify -verify_hostname press-1.local "$cell/press-1.crt" || die "not for press-1.local"
for address in 10.0.0.5 ::1; do verify -verify_ip "$address" "$cell/press-1.crt" || die "not for $address"; done
! verify -verify_ip 10.0.0.6 "$cell/press-1.crt" || die "for an address that was not given"
cmp <(openssl x509 -in "$cell/press-1.crt" -noout -pubkey) <(openssl pkey -in "$cell/press-1.key" -pubout) || die "no pair"
mode '' 700
mode ca.key 600
mode press-1.key 600
mode press-1.crt 644
mode clients.crl 644

cp "$cell/shift-a.crt" "$scratch/before.crt"
pki --days 30 renew shift-a >/dev/null
good sslclient "$scratch/before.crt"
good sslclient "$cell/shift-a.crt"
openssl x509 -in "$cell/shift-a.crt" -noout -checkend $((29 * 86400)) >/dev/null || die "less than 30 days"
! openssl x509 -in "$cell/shift-a.crt" -noout -checkend $((31 * 86400)) >/dev/null || die "more than 30 days"
verify -verify_ip 10.0.0.5 "$cell/press-1.crt"
pki renew press-1 >/dev/null
verify -verify_ip 10.0.0.5 "$cell/press-1.crt" || die "a renewed certificate lost its addresses"

cp "$cell/shift-a.crt" "$scratch/after.crt"
mv "$cell" "$scratch/moved"
mv "$scratch/moved" "$cell"
[[ $(pki revoke shift-a) == "shift-a: 2 revoked"* ]] || die "not both were revoked"
revoked "$scratch/before.crt"
revoked "$scratch/after.crt"
good sslclient "$cell/panel.crt"
[[ $(pki list | grep -c '^revoked .* shift-a ') == 2 ]] || die "the list does not show it"
pki client shift-a >/dev/null
good sslclient "$cell/shift-a.crt"
[[ $(pki --days 7 crl) == *"valid for 7 days" ]] || die "no new list"
revoked "$scratch/before.crt"

# Two that show the same name: each is renewed and revoked alone.
pki client gate-1 gates >/dev/null
pki client gate-2 gates >/dev/null
pki renew gate-1 >/dev/null
for name in gate-1 gate-2; do
  good sslclient "$cell/$name.crt"
  [[ $(openssl x509 -in "$cell/$name.crt" -noout -subject -nameopt compat) == *"/CN=gates/OU=$name" ]] || die "$name does not show gates"
done
cp "$cell/gate-1.crt" "$scratch/gate-1.crt"
[[ $(pki revoke gate-1) == "gate-1: 2 revoked"* ]] || die "not both of gate-1 were revoked"
revoked "$scratch/gate-1.crt"
good sslclient "$cell/gate-2.crt"
[[ $(pki list | grep -c 'gates as gate-') == 3 ]] || die "the list does not show them"

refused "is there already" client panel
refused "is no usable name" client 'a b'
refused "give it without a port" server x 10.0.0.5:7443
refused "is no address" peer x 10.0.0.5 a:b:c:d:x
refused "is no address" server x a:b:c:d:x
refused "is not known here" renew nobody
refused "nothing that could be revoked" revoke nobody
refused "give 1 to 99999" --days 0 crl
[ ! -e "$cell/x.crt" ] || die "a pair was made of a wrong host"
