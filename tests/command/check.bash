# For the scripts of this folder: `source` it; then `expect STATUS TEXT WORD...` runs the built command with the words and
# wants that exit status and TEXT (a literal; empty: anything) in what it says on either stream; `finish` ends.
source_folder=$1 build_folder=$2
ropsim=$build_folder/ropsim
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0 checks=0

complain() {
    echo "$*"
    failures=$((failures + 1))
}

expect() {
    local wanted=$1 text=$2 said status=0
    shift 2
    checks=$((checks + 1))
    said=$("$ropsim" "$@" 2>&1) || status=$?
    [[ $status == "$wanted" ]] || complain "ropsim $*: exit status $status, wanted $wanted; it said: $said"
    [[ -z $text || $said == *"$text"* ]] || complain "ropsim $*: \`$text\` is not in: $said"
}

finish() {
    ((checks > 0)) || complain "no check ran"
    exit $((failures > 0))
}
