#include "tests/bench/suite/suite_csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "core/base/error.h"
#include "tests/bench/suite/suite_table.h"

namespace color3d {
namespace {

constexpr const char* kMetricColumns[] = {kRankingMetric,
                                          "delta_e00_chroma_2d",
                                          "delta_e00_chroma_bound",
                                          "delta_e00",
                                          "delta_e00_gray",
                                          "psnr_rgb",
                                          "psnr_l",
                                          "ssim_rgb",
                                          "colorfulness_ratio",
                                          "me_common",
                                          "tc_common",
                                          "tc_chroma",
                                          "cdc",
                                          "gaussians",
                                          "seconds_total",
                                          "peak_memory_bytes"};

std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

// The cells of a line, without their quotes.
std::vector<std::string> CsvCells(const std::string& line) {
  std::vector<std::string> cells(1);
  bool inside_quotes = false;
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && inside_quotes && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back() += line[++i];
    } else if (c == '"') {
      inside_quotes = !inside_quotes;
    } else if (c == ',' && !inside_quotes) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

// {"view":1.5,"other":2.25}, with four decimals; "" without views.
std::string ViewErrorsToCell(const std::map<std::string, double>& errors) {
  if (errors.empty()) return "";
  nlohmann::json json;
  for (const auto& [view, error] : errors) json[view] = std::round(error * 1e4) / 1e4;
  return json.dump();
}

SuiteRow RowFromCells(const std::map<std::string, std::string>& cells) {
  SuiteRow row;
  row.scene = cells.at("scene");
  row.preset = cells.at("preset");
  row.seed = std::stoull(cells.at("seed"));
  row.options_digest = cells.at("options");
  row.failure = cells.at("failure");
  row.wall_seconds = std::stod(cells.at("wall_seconds"));
  row.commit = cells.at("commit");
  row.machine = cells.at("machine");
  for (const char* metric : kMetricColumns) {
    const std::string& cell = cells.at(metric);
    if (!cell.empty()) row.metrics[metric] = std::stod(cell);
  }
  const std::string& errors = cells.at("view_errors");
  if (!errors.empty()) row.view_errors = nlohmann::json::parse(errors);
  return row;
}

}  // namespace

std::string RowsToCsv(const std::vector<SuiteRow>& rows) {
  std::string text = "scene,preset,seed,options,failure";
  for (const char* metric : kMetricColumns) text += std::string(",") + metric;
  text += ",wall_seconds,commit,machine,view_errors\n";
  for (const SuiteRow& row : rows) {
    std::string failure = row.failure;
    std::replace(failure.begin(), failure.end(), '\n', ' ');
    text += fmt::format(
        "{},{},{},{},{}", row.scene, row.preset, row.seed, row.options_digest, Quoted(failure));
    for (const char* metric : kMetricColumns) {
      const double value = row.Metric(metric);
      text += std::isfinite(value) ? fmt::format(",{:.6g}", value) : ",";
    }
    text += fmt::format(",{:.1f},{},{},{}\n",
                        row.wall_seconds,
                        Quoted(row.commit),
                        Quoted(row.machine),
                        Quoted(ViewErrorsToCell(row.view_errors)));
  }
  return text;
}

std::vector<SuiteRow> RowsFromCsv(const std::string& csv) {
  std::istringstream stream(csv);
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> columns = CsvCells(line);
  std::vector<SuiteRow> rows;
  for (int number = 2; std::getline(stream, line); ++number) {
    const std::vector<std::string> values = CsvCells(line);
    std::map<std::string, std::string> cells;
    for (size_t i = 0; i < std::min(columns.size(), values.size()); ++i) {
      cells[columns[i]] = values[i];
    }
    try {
      rows.push_back(RowFromCells(cells));
    } catch (const std::exception& e) {
      throw InvalidArgument("line {} is not a row of a suite: {}", number, e.what());
    }
  }
  return rows;
}

}  // namespace color3d
