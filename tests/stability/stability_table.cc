#include "tests/stability/stability_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <stdexcept>

#include "core/base/digest.h"

namespace color3d {
namespace {

constexpr std::string_view kDigestBegins = "Digest of cases and bounds: `";
constexpr std::string_view kGroupBegins = "## ";
constexpr std::string_view kRowBegins = "| ";

std::string Number(double value) {
  if (std::isnan(value)) return "-";
  if (std::isinf(value)) return "singular";
  return fmt::format("{:.1e}", value);
}

// A vertical bar would end the cell.
std::string Cell(std::string text) {
  std::replace(text.begin(), text.end(), '|', '/');
  return text.empty() ? "-" : text;
}

// The cells of a row of a case; none for headings and other lines.
std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells;
  if (line.rfind(kRowBegins, 0) != 0 || line.rfind("| case |", 0) == 0) return cells;
  std::istringstream stream(line.substr(1));
  for (std::string cell; std::getline(stream, cell, '|');) {
    const size_t begin = cell.find_first_not_of(' ');
    cells.push_back(begin == std::string::npos
                        ? ""
                        : cell.substr(begin, cell.find_last_not_of(' ') - begin + 1));
  }
  return cells;
}

struct MarkdownRow {
  std::string group_and_name;
  std::string bounds;
};

std::vector<MarkdownRow> Rows(const std::string& markdown) {
  std::vector<MarkdownRow> rows;
  std::istringstream stream(markdown);
  std::string group;
  for (std::string line; std::getline(stream, line);) {
    if (line.rfind(kGroupBegins, 0) == 0) group = line.substr(kGroupBegins.size());
    const std::vector<std::string> cells = Cells(line);
    if (cells.size() > 5) rows.push_back({group + ", " + cells[0], cells[3] + ", " + cells[5]});
  }
  return rows;
}

std::string RowText(const StabilityRow& row) {
  const StabilityResult& r = row.result;
  const bool conditioned = r.condition_of != "-" && !r.condition_of.empty();
  std::string happened = r.outcome;
  if (r.restores > 0)
    happened += fmt::format("{}{} restores", happened.empty() ? "" : "; ", r.restores);
  if (!r.Passed()) happened = "FAILED " + happened;
  return fmt::format(
      "| {} | {} | {} | {} | {} | {} | {} |\n",
      Cell(row.stability_case.name),
      conditioned ? fmt::format("{} ({})", Number(r.condition), r.condition_of) : "-",
      Number(r.value_error),
      std::isnan(r.value_error) ? "-" : Number(r.value_bound),
      Number(r.gradient_error),
      std::isnan(r.gradient_error) ? "-" : Number(r.gradient_bound),
      Cell(happened));
}

}  // namespace

std::string PrintedBounds(const StabilityResult& r) {
  return (std::isnan(r.value_error) ? "-" : Number(r.value_bound)) + ", " +
         (std::isnan(r.gradient_error) ? "-" : Number(r.gradient_bound));
}

std::vector<std::string> CasesOfMarkdown(const std::string& markdown) {
  std::vector<std::string> names;
  for (const MarkdownRow& row : Rows(markdown)) names.push_back(row.group_and_name);
  return names;
}

std::string StatedDigest(const std::string& markdown) {
  const size_t begin = markdown.find(kDigestBegins);
  if (begin == std::string::npos) return "";
  const size_t digest = begin + kDigestBegins.size();
  return markdown.substr(digest, markdown.find('`', digest) - digest);
}

std::string DigestOfRows(const std::string& markdown) {
  std::string text;
  for (const MarkdownRow& row : Rows(markdown))
    text += row.group_and_name + ", " + row.bounds + "\n";
  return Sha256Hex(text).substr(0, 16);
}

std::string BoundsOfCase(const std::string& markdown, const std::string& group_and_name) {
  for (const MarkdownRow& row : Rows(markdown)) {
    if (row.group_and_name == group_and_name) return row.bounds;
  }
  throw std::out_of_range(group_and_name);
}

std::string StabilityMarkdown(const std::vector<StabilityRow>& rows) {
  std::string tables, group;
  for (const StabilityRow& row : rows) {
    if (row.stability_case.group != group) {
      group = row.stability_case.group;
      tables +=
          "\n" + std::string(kGroupBegins) + group +
          "\n\n| case | condition number (of) | error | bound | gradient error | bound | result |\n"
          "|---|--:|--:|--:|--:|--:|---|\n";
    }
    tables += RowText(row);
  }
  const auto failed = std::count_if(
      rows.begin(), rows.end(), [](const StabilityRow& row) { return !row.result.Passed(); });
  return fmt::format(
      "# Stability: stiff and extreme cases\n\n"
      "{} cases, {} failed. Errors are relative to the largest value, against float64 or an exact\n"
      "answer ([stability_case.h](stability_case.h)); bounds follow from the condition number "
      "where a\n"
      "case has one. In no case is a value not finite. `-`: not compared; then the result says "
      "what\n"
      "was required or refused.\n\n"
      "Made by `color3d-bench stability --markdown tests/stability/{}`; the fast cases run in the\n"
      "default test suite, on every instruction set of the machine. {}{}`.\n{}",
      rows.size(),
      failed,
      kStabilityTable,
      kDigestBegins,
      DigestOfRows(tables),
      tables);
}

}  // namespace color3d
