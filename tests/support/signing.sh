#!/usr/bin/env bash
# Signs files with a key made for this, and checks that packaging/verify believes them, and nothing else.
set -euo pipefail
packaging=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../../packaging")
if ! command -v ssh-keygen >/dev/null; then
  printf 'skipped: openssh-client is not installed\n' >&2
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
files=$work/files
mkdir -p "$files/more"
printf 'a program\n' >"$files/spindle"
printf 'a package\n' >"$files/more/spindle 1.deb"
for key in ours theirs; do ssh-keygen -q -t ed25519 -N '' -C "$key" -f "$work/$key"; done
printf 'release@spindle %s\n' "$(cat "$work/ours.pub")" >"$work/signers"

fail() {
  printf 'signing: %s\n' "$*" >&2
  exit 1
}
believed() { "$packaging/verify" "$files" "$work/signers" >"$work/told" 2>&1; }
# refused WHAT; what was done is undone by signing anew
refused() {
  if believed; then fail "$1 is believed: $(cat "$work/told")"; fi
  "$packaging/sign" "$files" "$work/ours" 2>/dev/null
  believed || fail "behind $1: $(cat "$work/told")"
}

"$packaging/sign" "$files" "$work/ours" 2>/dev/null
believed || fail "what was signed is not believed: $(cat "$work/told")"
grep -q '^2 files are as release@spindle signed them$' "$work/told" || fail "it says: $(cat "$work/told")"
[[ $(cut -c67- "$files/SHA256SUMS") == $'more/spindle 1.deb\nspindle' ]] || fail "the list: $(cat "$files/SHA256SUMS")"

printf 'another program\n' >"$files/spindle"
refused 'a file that was changed'
mv "$files/spindle" "$files/elsewhere"
refused 'a file with another name'
mv "$files/elsewhere" "$files/spindle"
refused 'a file that is not listed'
sed -i '1d' "$files/SHA256SUMS"
refused 'a shortened list'
"$packaging/sign" "$files" "$work/theirs" 2>/dev/null
refused 'the key of another'
rm "$files/SHA256SUMS.sig"
refused 'a list without a signature'
if "$packaging/verify" "$files" "$work/signers" other@spindle >/dev/null 2>&1; then fail 'another name is believed'; fi
if "$packaging/sign" "$work/nowhere" "$work/ours" 2>/dev/null; then fail 'it signs what is not there'; fi
