#include "tests/bench/colorizer/choice_results.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;

std::string Text(const char* format, double value) {
  char text[40];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

template <typename T>
void AddOnce(const T& value, std::vector<T>& values) {
  if (std::find(values.begin(), values.end(), value) == values.end()) values.push_back(value);
}

// A setting at a number of iterations, over all scenes.
struct Row {
  std::string value;
  int iterations = 0;
  std::vector<ChoicePoint> scenes;

  double Mean(double ChoicePoint::*figure) const {
    double sum = 0.0;
    for (const ChoicePoint& point : scenes) sum += point.*figure;
    return sum / static_cast<double>(scenes.size());
  }
};

class Results {
 public:
  explicit Results(const std::vector<ChoicePoint>& points) : points_(points) {
    for (const ChoicePoint& point : points) {
      AddOnce(point.scene, scenes_);
      AddOnce(point.choice, choices_);
      AddOnce(point.value, values_);
      iterations_.insert(point.iterations);
    }
  }

  const std::vector<std::string>& scenes() const { return scenes_; }
  const std::vector<std::string>& choices() const { return choices_; }

  // Rows of a choice, by value and iterations, without those that lack a scene.
  std::vector<Row> RowsOf(const std::string& choice) const {
    std::vector<Row> rows;
    for (const std::string& value : values_) {
      for (const int iterations : iterations_) {
        Row row{value, iterations, {}};
        for (const std::string& scene : scenes_) {
          const auto found = std::find_if(points_.begin(), points_.end(), [&](const auto& p) {
            return p.SameWork(
                {.scene = scene, .choice = choice, .value = value, .iterations = iterations});
          });
          if (found != points_.end()) row.scenes.push_back(*found);
        }
        if (row.scenes.size() == scenes_.size()) rows.push_back(std::move(row));
      }
    }
    return rows;
  }

  // The default first, at the numbers of iterations of the others.
  std::vector<Row> RowsBesideDefault(const std::string& choice) const {
    std::vector<Row> rows = RowsOf(choice);
    if (choice == kDefaultChoice || rows.empty()) return rows;
    std::set<int> wanted;
    for (const Row& row : rows) wanted.insert(row.iterations);
    std::vector<Row> all;
    for (Row& row : RowsOf(kDefaultChoice)) {
      row.value = kDefaultChoice;
      if (wanted.contains(row.iterations)) all.push_back(std::move(row));
    }
    all.insert(all.end(), rows.begin(), rows.end());
    return all;
  }

 private:
  const std::vector<ChoicePoint>& points_;
  std::vector<std::string> scenes_, choices_, values_;
  std::set<int> iterations_;
};

ordered_json JsonOf(const ChoicePoint& p) {
  return {{"scene", p.scene},
          {"choice", p.choice},
          {"value", p.value},
          {"iterations", p.iterations},
          {"seconds", p.seconds},
          {"wall_seconds", p.wall_seconds},
          {"views", p.views},
          {"delta_e00_alone", p.alone},
          {"delta_e00_delivered", p.delivered}};
}

std::optional<ChoicePoint> PointFrom(const std::string& line) {
  try {
    const auto json = nlohmann::json::parse(line);
    return ChoicePoint{json.at("scene"),
                       json.at("choice"),
                       json.at("value"),
                       json.at("iterations"),
                       json.at("seconds"),
                       json.at("wall_seconds"),
                       json.at("views"),
                       json.at("delta_e00_alone"),
                       json.at("delta_e00_delivered")};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

std::string Cells(const Row& row, double ChoicePoint::*figure) {
  std::string text;
  for (const ChoicePoint& point : row.scenes) text += " " + Text("%.2f", point.*figure) + " |";
  return text + " " + Text("%.2f", row.Mean(figure)) + " |";
}

}  // namespace

std::vector<ChoicePoint> ReadChoicePoints(const std::filesystem::path& jsonl) {
  std::vector<ChoicePoint> points;
  if (!std::filesystem::exists(jsonl)) return points;
  std::istringstream lines(ReadFile(jsonl));
  for (std::string line; std::getline(lines, line);) {
    const std::optional<ChoicePoint> point = PointFrom(line);
    if (!point) continue;
    const auto earlier = std::find_if(
        points.begin(), points.end(), [&](const auto& p) { return p.SameWork(*point); });
    if (earlier == points.end()) {
      points.push_back(*point);
    } else {
      *earlier = *point;
    }
  }
  return points;
}

std::vector<ChoicePoint> ReadChoiceFolders(const std::vector<std::string>& folders) {
  std::vector<ChoicePoint> points;
  for (const std::filesystem::path folder : folders) {
    const std::filesystem::path file = folder / kChoicePoints;
    if (!std::filesystem::exists(file)) {
      throw Error(ErrorCode::kNotFound,
                  "{} has no {}; run choices for a scene first",
                  folder.string(),
                  kChoicePoints);
    }
    const std::vector<ChoicePoint> more = ReadChoicePoints(file);
    points.insert(points.end(), more.begin(), more.end());
  }
  return points;
}

void AppendChoicePoint(const std::filesystem::path& jsonl, const ChoicePoint& point) {
  std::string text = std::filesystem::exists(jsonl) ? ReadFile(jsonl) : "";
  if (!text.empty() && text.back() != '\n') text += "\n";
  WriteFileAtomic(jsonl, text + JsonOf(point).dump() + "\n");
}

std::string ChoiceTables(const std::vector<ChoicePoint>& points) {
  const Results results(points);
  std::string head = "| value | iterations | seconds |", rule = "|---|--:|--:|";
  for (const char* what : {"alone", "delivered"}) {
    for (const std::string& scene : results.scenes()) head += " " + scene + ", " + what + " |";
    head += std::string(" mean, ") + what + " |";
    for (size_t i = 0; i <= results.scenes().size(); ++i) rule += "--:|";
  }
  std::string text;
  for (const std::string& choice : results.choices()) {
    const std::vector<Row> rows = results.RowsBesideDefault(choice);
    if (rows.empty()) continue;
    text += (text.empty() ? "### " : "\n### ") + choice + "\n\n" + head + "\n" + rule + "\n";
    for (const Row& row : rows) {
      text += "| " + row.value + " | " + std::to_string(row.iterations) + " | " +
              Text("%.1f", row.Mean(&ChoicePoint::seconds)) + " |" +
              Cells(row, &ChoicePoint::alone) + Cells(row, &ChoicePoint::delivered) + "\n";
    }
  }
  return text;
}

std::vector<Plot> ChoicePlots(const std::vector<ChoicePoint>& points, bool delivered) {
  const Results results(points);
  const auto figure = delivered ? &ChoicePoint::delivered : &ChoicePoint::alone;
  std::vector<Plot> plots;
  for (const std::string& choice : results.choices()) {
    Plot plot;
    plot.title = choice;
    plot.log_seconds = true;
    const std::vector<Row> rows = results.RowsOf(choice);
    if (rows.empty()) continue;
    std::vector<Row> shown = results.RowsOf(kDefaultChoice);
    for (Row& row : shown) row.value = kDefaultChoice;
    if (choice != kDefaultChoice) shown.insert(shown.end(), rows.begin(), rows.end());
    for (const Row& row : shown) {
      if (plot.series.empty() || plot.series.back().name != row.value) {
        plot.series.push_back({row.value, {}});
      }
      plot.series.back().points.push_back(
          {"", row.Mean(&ChoicePoint::seconds), row.iterations, "", row.Mean(figure)});
    }
    plots.push_back(std::move(plot));
  }
  return plots;
}

}  // namespace color3d
