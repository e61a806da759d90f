// Results of `color3d-bench choices`: one JSON line per point, and the tables over them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/report/plot.h"

namespace color3d {

// One colorizer, trained to the end of its schedule with one choice other than the default.
struct ChoicePoint {
  std::string scene;   // last component of its folder
  std::string choice;  // e.g. "crop"; kDefaultChoice when everything is as by default
  std::string value;   // e.g. "128"; empty for the default
  int iterations = 0;
  double seconds = 0.0;       // of the process's CPU time, over the threads
  double wall_seconds = 0.0;  // of the same
  int views = 0;              // held out, that errors are means of
  double alone = 0.0;         // CIEDE2000 of the colorizer's answers
  double delivered = 0.0;     // after fusion with what was carried

  bool SameWork(const ChoicePoint& other) const {
    return scene == other.scene && choice == other.choice && value == other.value &&
           iterations == other.iterations;
  }
};

inline constexpr char kDefaultChoice[] = "default";
inline constexpr char kChoicePoints[] = "choices.jsonl";  // in the --out folder of a scene

// Lines that cannot be read (the last one of a run that was killed) count as not there. No file:
// none. Later lines win over earlier ones of the same work.
std::vector<ChoicePoint> ReadChoicePoints(const std::filesystem::path& jsonl);
// The points of several such folders.
std::vector<ChoicePoint> ReadChoiceFolders(const std::vector<std::string>& folders);
// Adds a line, durably.
void AppendChoicePoint(const std::filesystem::path& jsonl, const ChoicePoint& point);

// Markdown: a chapter for each choice, in order of appearance, with a row for each value and number
// of iterations that all scenes have, the default's rows first.
std::string ChoiceTables(const std::vector<ChoicePoint>& points);

// Error against seconds, a plot for each choice beside the whole curve of the default: means over
// the scenes. `delivered`: that error instead of the colorizer's own.
std::vector<Plot> ChoicePlots(const std::vector<ChoicePoint>& points, bool delivered);

}  // namespace color3d
