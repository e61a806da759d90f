// Results of `color3d-bench choices`: one JSON line per point, and the tables over them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/report/plot.h"

namespace color3d {

// Result of a colorizer trained to the end of its schedule, with one choice other than the default.
struct ChoicePoint {
  std::string scene;   // last component of its folder
  std::string choice;  // e.g. "crop"; kDefaultChoice for the default
  std::string value;   // e.g. "128"; empty for the default
  int iterations = 0;
  double seconds = 0.0;       // CPU time of the process, divided by the number of threads
  double wall_seconds = 0.0;  // wall time
  int views = 0;              // number of held-out views
  double alone = 0.0;         // CIEDE2000 of the colorizer
  double delivered = 0.0;     // CIEDE2000 after fusion with carried colours

  bool SameWork(const ChoicePoint& other) const {
    return scene == other.scene && choice == other.choice && value == other.value &&
           iterations == other.iterations;
  }
};

inline constexpr char kDefaultChoice[] = "default";
inline constexpr char kChoicePoints[] = "choices.jsonl";  // in the --out folder of a scene

// Reads the points of a file, none if it does not exist. Ignores unreadable lines (the last one of
// a killed run). Later lines override earlier ones of the same work.
std::vector<ChoicePoint> ReadChoicePoints(const std::filesystem::path& jsonl);
// Reads the points of several folders.
std::vector<ChoicePoint> ReadChoiceFolders(const std::vector<std::string>& folders);
// Appends a line durably.
void AppendChoicePoint(const std::filesystem::path& jsonl, const ChoicePoint& point);

// Returns Markdown: a section per choice, in order of appearance, with a row for each value and
// number of iterations that all scenes have, the default first.
std::string ChoiceTables(const std::vector<ChoicePoint>& points);

// Returns a plot of error against seconds for each choice, with the curve of the default: means
// over the scenes. `delivered`: plots that error instead of `alone`.
std::vector<Plot> ChoicePlots(const std::vector<ChoicePoint>& points, bool delivered);

}  // namespace color3d
