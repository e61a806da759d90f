// The formats that the stage export writes, one row each. The planner, the options of the stage,
// the table of artifacts and the stage itself read them here. A new format is a field of ExportSpec
// in stage.proto, an enumerator and a row here, and a case in core/stage/export.cc. Constants and
// pure functions.
#pragma once

#include <set>
#include <string>

#include "core/catalogue/artifacts.h"

namespace color3d {

enum class ExportFormat { kPly, kSog, kSpz, kGlb, kSplat, kSplat4d, kMoments };

// Default of the option of a format.
enum class ExportDefault {
  kOff,
  kOn,
  kAsPly,       // when the PLY is
  kWithOthers,  // when another format is
};

struct ExportFormatInfo {
  ExportFormat format;
  const char* option;  // field of color3d.v1.ExportSpec: a switch, or a number of files
  const char* artifact;
  ExportDefault by_default = ExportDefault::kOff;
  bool needs_motion = false;        // written for dynamic scenes only
  bool carries_confidence = false;  // obeys ExportOptions::confidence
  const char* media_type = "application/octet-stream";
  const char* label = nullptr;  // in the client's list of results; nullptr: not listed
};

inline constexpr ExportFormatInfo kExportFormats[] = {
    {.format = ExportFormat::kPly,
     .option = "ply",
     .artifact = artifact::kPly,
     .by_default = ExportDefault::kOn,
     .carries_confidence = true,
     .label = "coloured scene"},
    {.format = ExportFormat::kSog,
     .option = "sog",
     .artifact = artifact::kSog,
     .by_default = ExportDefault::kAsPly},
    {.format = ExportFormat::kSpz, .option = "spz", .artifact = artifact::kSpz},
    {.format = ExportFormat::kGlb, .option = "glb", .artifact = "scene.glb"},
    {.format = ExportFormat::kSplat, .option = "splat", .artifact = "scene.splat"},
    {.format = ExportFormat::kSplat4d,
     .option = "splat4d",
     .artifact = "scene.splat4d",
     .by_default = ExportDefault::kWithOthers,
     .needs_motion = true},
    {.format = ExportFormat::kMoments,
     .option = "moments",
     .artifact = artifact::kMoments,
     .needs_motion = true},
};

const ExportFormatInfo& InfoOf(ExportFormat format);

// The formats that are written when no option is set.
std::set<ExportFormat> DefaultExportFormats();

// The options of all formats, for messages: "ply, sog or moments".
std::string ExportFormatNames();

}  // namespace color3d
