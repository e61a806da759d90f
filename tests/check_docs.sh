#!/usr/bin/env bash
# Checks that documents agree with the sources. Fails on
#   - a relative link in a *.md to a file or heading that does not exist;
#   - a `path/of/a.source`, a `CamelCase`, `snake_case` or `CAPITAL_CASE` name or a `--flag` in code quotes
#     that the sources do not have (except in CHANGELOG.md, which has old names);
#   - a comment that cites a document, or a section of one, that does not exist: STILL.md "Stage 1a"
#     means a heading that begins with these words in the STILL.md of the repository;
#   - a README.md of more than 1200 words, or a tests/bench/RESULTS.md of more than 200 lines.
# Flags and names of other projects are listed below.
set -euo pipefail
cd "$(dirname "$0")/.."

other_flags='--build --install --prefix --preset --target --test-dir --output-on-failure --gtest_filter
  --plugin --python_out --grpc_python_out --ignore-scripts --pwprompt --owner --encoding --template
  --format --file --dbname --rm --entrypoint --scale --type --from-file --requeue'
other_names='add_secure_port transport_socket per_connection_buffer_limit_bytes pg_dump target_session_attrs
  condor_submit job_max_vacate_time'

lists=$(mktemp -d)
trap 'rm -rf "$lists"' EXIT
git ls-files --cached --others --exclude-standard | while read -r file; do
  [ ! -f "$file" ] || echo "$file"
done >"$lists/files"
grep -E '\.(h|cc|proto|textproto|txtpb|sh|py|mjs|cmake|json|in)$|(^|/)CMakeLists\.txt$|(^|/)\.clang-[a-z]+$' \
  "$lists/files" | grep -v '^tests/check_docs\.sh$' >"$lists/sources"
grep '\.md$' "$lists/files" >"$lists/documents"
{
  xargs grep -ohE '[A-Za-z_][A-Za-z0-9_]+' <"$lists/sources"
  tr -s ' \n' '\n' <<<"$other_names"
} | sort -u >"$lists/words"
{
  grep -vE '_test\.cc$|^tests/integration/' "$lists/sources" | xargs grep -ohE -e '--[a-z][a-z0-9_-]*'
  tr -s ' \n' '\n' <<<"$other_flags"
} | sort -u >"$lists/flags"
xargs grep -lE '\.md\b|\b(README|METHOD|DESIGN)\b' <"$lists/sources" >"$lists/citing" || true

cat >"$lists/check.awk" <<'AWK'
function complain(line, text) {
  printf "check_docs: %s:%d: %s\n", FILENAME, line, text > "/dev/stderr"
  bad = 1
}
function folder(path) { return path ~ /\// ? substr(path, 1, match(path, /\/[^\/]*$/)) : "" }
# "a/b/../c/./d" -> "a/c/d"
function normal(path,    parts, kept, n, i, out, depth) {
  n = split(path, parts, "/")
  depth = 0
  for (i = 1; i <= n; ++i) {
    if (parts[i] == "" || parts[i] == ".") continue
    if (parts[i] == ".." && depth > 0) { --depth; continue }
    kept[++depth] = parts[i]
  }
  out = ""
  for (i = 1; i <= depth; ++i) out = out (i > 1 ? "/" : "") kept[i]
  return out
}
# The anchor that GitHub gives a heading.
function anchor(heading) {
  heading = tolower(heading)
  gsub(/[^a-z0-9 _-]/, "", heading)
  gsub(/ /, "-", heading)
  return heading
}
function heading_of(line) {
  sub(/^#+ +/, "", line)
  gsub(/\]\([^)]*\)/, "", line)
  gsub(/[`*\[]/, "", line)
  return line
}

function check_link(target, line,    hash, path, name) {
  if (target ~ /^[a-z]+:/) return
  hash = index(target, "#")
  name = hash ? substr(target, hash + 1) : ""
  path = hash ? substr(target, 1, hash - 1) : target
  path = path == "" ? FILENAME : normal(folder(FILENAME) path)
  if (path != "" && !(path in exists)) {
    complain(line, "the target of the link " target " does not exist")
  } else if (name != "" && path ~ /\.md$/ && !((path, name) in anchors)) {
    complain(line, path " has no heading #" name)
  }
}
function check_path(path, line) {
  sub(/\/$/, "", path)
  if ((path in exists) || (path in suffix) || (normal(folder(FILENAME) path) in exists)) return
  complain(line, "there is no " path)
}
function check_flags(text, line,    flag) {
  while (match(text, /(^|[ "(\[|])--[a-z][a-z0-9_-]+/)) {
    flag = substr(text, RSTART, RLENGTH)
    text = substr(text, RSTART + RLENGTH)
    sub(/^[^-]/, "", flag)
    if (!(flag in flags)) complain(line, "no program has the flag " flag)
  }
}
function check_code(span, line,    parts, n, i, name) {
  if (FILENAME ~ /CHANGELOG\.md$/) return
  check_flags(span, line)
  if (span ~ /^[A-Za-z0-9_.\/-]+\.(cc|h|proto|sh|py|md|cmake|awk)$/ ||
      span ~ /^(core|server|client|tests|proto|deploy)\/[A-Za-z0-9_.\/-]+$/) {
    check_path(span, line)
    return
  }
  if (span ~ /["\\<>#\/]/) return
  gsub(/(^| )-D/, " ", span)
  n = split(span, parts, /[^A-Za-z0-9_]+/)
  for (i = 1; i <= n; ++i) {
    name = parts[i]
    if (length(name) < 6) continue
    if (name ~ /^k?[A-Z][a-z0-9]+([A-Z][A-Za-z0-9]*)+$/ || name ~ /^k[A-Z][A-Za-z0-9]+$/ ||
        name ~ /^[a-z][a-z0-9]*(_[a-z0-9]+)+$/ || name ~ /^[A-Z][A-Z0-9]*(_[A-Z0-9]+)+$/) {
      if (!(name in words)) complain(line, "the sources have no name " name)
    }
  }
}
function check_text(text, line,    rest, target, at) {
  rest = text
  while (match(rest, /\]\([^() \t]+\)/)) {
    target = substr(rest, RSTART + 2, RLENGTH - 3)
    rest = substr(rest, RSTART + RLENGTH)
    check_link(target, line)
  }
  # Code quotes may continue in the next line.
  while ((at = index(text, "`")) > 0) {
    if (in_code) check_code(code substr(text, 1, at - 1), line)
    code = ""
    in_code = !in_code
    text = substr(text, at + 1)
  }
  if (in_code) code = code text " "
}

# The document that a comment in `source` cites as `name`; empty: none.
function cited(name, source) {
  if (name in exists) return name
  if (normal(folder(source) name) in exists) return normal(folder(source) name)
  return (name in document_by_suffix) ? document_by_suffix[name] : ""
}
function has_section(document, section,    i) {
  for (i = 1; i <= headings[document]; ++i) {
    if (index(tolower(heading[document, i]), tolower(section)) == 1) return 1
  }
  return 0
}
function check_comment(source, line, text,    name, document, section, problem) {
  while (match(text, /[A-Za-z0-9_.\/-]*\.md|(^|[^A-Za-z0-9_])(README|METHOD|DESIGN)([^A-Za-z0-9_.]|\.[^m]|\.?$)/)) {
    name = substr(text, RSTART, RLENGTH)
    text = substr(text, RSTART + RLENGTH - (name ~ /\.md$/ ? 0 : 1))
    problem = ""
    if (name !~ /\.md$/) {
      gsub(/[^A-Z]/, "", name)
      if (name != "README") problem = "cites " name ", which is not a document of the repository"
      name = "README.md"
    }
    document = cited(name, source)
    if (problem == "" && document == "") problem = "cites " name ", which does not exist"
    while (problem == "" && match(text, /^[,:]? *(and )?"[^"]+"/)) {
      section = substr(text, RSTART, RLENGTH)
      text = substr(text, RSTART + RLENGTH)
      sub(/^[^"]*"/, "", section)
      sub(/"$/, "", section)
      if (!has_section(document, section)) problem = "cites \"" section "\", which is not a section of " document
    }
    if (problem == "") continue
    printf "check_docs: %s:%d: the comment %s\n", source, line, problem > "/dev/stderr"
    bad = 1
  }
}
function end_comment() {
  if (comment != "") check_comment(comment_source, comment_line, comment)
  comment = ""
}

pass == "files" {
  exists[$0] = 1
  for (path = $0; (at = match(path, /\/[^\/]*$/)) > 0;) { path = substr(path, 1, at - 1); exists[path] = 1 }
  for (path = $0; (at = index(path, "/")) > 0;) {
    path = substr(path, at + 1)
    suffix[path] = 1
    if (path ~ /\.md$/) document_by_suffix[path] = $0
  }
  next
}
pass == "words" { words[$0] = 1; next }
pass == "flags" { flags[$0] = 1; next }
pass == "headings" {
  if (FNR == 1) fenced = 0
  if (/^ *(```|~~~)/) fenced = !fenced
  if (!fenced && /^#+ /) {
    text = heading_of($0)
    heading[FILENAME, ++headings[FILENAME]] = text
    name = anchor(text)
    anchors[FILENAME, name ((FILENAME, name) in anchors ? "-" ++repeated[FILENAME, name] : "")] = 1
  }
  next
}
pass == "documents" {
  if (FNR == 1) { fenced = 0; in_code = 0; code = "" }
  if (/^ *(```|~~~)/) { fenced = !fenced; in_code = 0; code = ""; next }
  if (fenced) {
    ours = /(^|[ \/(])(color3d(-[a-z]+)*|[a-z_-]+\.sh|backend\.py)( |$)/
    if (ours && FILENAME !~ /CHANGELOG\.md$/) check_flags($0, FNR)
    next
  }
  if (/^[ \t]*$/) { in_code = 0; code = "" }
  check_text($0, FNR)
  next
}
pass == "comments" {
  if (FNR == 1) end_comment()
  at = FILENAME ~ /\.(h|cc|proto)$/ ? index($0, "//") : match($0, /(^|[ \t])#/)
  if (at == 0) { end_comment(); next }
  if (substr($0, 1, at - 1) ~ /[^ \t]/) end_comment()
  text = substr($0, at)
  gsub(/^[ \t\/#]+|[ \t]+$/, "", text)
  if (comment == "") { comment_line = FNR; comment_source = FILENAME }
  comment = comment (comment == "" ? "" : " ") text
}
END { end_comment(); exit bad }
AWK

# README.md and RESULTS.md stay short: longer texts belong elsewhere.
words=$(wc -w <README.md)
lines=$(wc -l <tests/bench/RESULTS.md)
if [ "$words" -gt 1200 ] || [ "$lines" -gt 200 ]; then
  echo "check_docs: README.md has $words words (at most 1200), tests/bench/RESULTS.md $lines lines (at most 200)" >&2
  exit 1
fi

mapfile -t documents <"$lists/documents"
mapfile -t citing <"$lists/citing"
awk -f "$lists/check.awk" pass=files "$lists/files" pass=words "$lists/words" \
  pass=flags "$lists/flags" pass=headings "${documents[@]}" pass=documents "${documents[@]}" \
  pass=comments "${citing[@]}"
echo "check_docs: ok"
