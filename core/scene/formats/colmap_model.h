// COLMAP's sparse model as stored in its files, before it becomes a Scene. For this folder only.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/camera.h"
#include "core/scene/frame_times.h"

namespace color3d {

struct ColmapCamera {
  Camera camera;  // as captured
  Distortion distortion;
};

struct ColmapObservation {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  int64_t point_id = -1;  // -1: no 3D point
};

struct ColmapImage {
  std::string name;
  uint32_t camera_id = 0;
  Pose cam_from_world;
  std::vector<ColmapObservation> observations;
};

struct ColmapPoint {
  uint64_t id = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double error_px = -1.0;
  std::vector<uint32_t> image_ids;  // of its track, as stored
};

struct ColmapModel {
  std::map<uint32_t, ColmapCamera> cameras;
  std::map<uint32_t, ColmapImage> images;
  std::vector<ColmapPoint> points;
};

// Returns true if the folder has a cameras.bin or cameras.txt.
bool IsColmapFolder(const std::filesystem::path& folder);

// Reads the binary files if all three exist, else the text files. Throws Error{kInvalidArgument}
// naming file and place if one is truncated or inconsistent, or has a number that is not finite.
ColmapModel LoadColmapModel(const std::filesystem::path& folder);

// Shared by both readers. `model`: COLMAP's name ("SIMPLE_RADIAL"). `place`: start of messages.
int ColmapParameterCount(const std::string& model, const std::string& place);
std::string ColmapModelName(int model_id, const std::string& place);
ColmapCamera MakeColmapCamera(const std::string& model,
                              uint64_t width,
                              uint64_t height,
                              const std::vector<double>& parameters,
                              const std::string& place);
// Normalises the quaternion. Throws if it is zero or not finite.
Pose MakeColmapPose(const double (&qvec_wxyz)[4],
                    const double (&tvec)[3],
                    const std::string& place);
// Throws if the name has control characters, which would break lines of messages and logs.
void CheckColmapName(const std::string& name, const std::string& place);
void CheckColmapPoint(const ColmapPoint& point, const std::string& place);
// Converts a point. Its views are those whose images are on its track; images without a view are
// ignored.
SparsePoint MakeSparsePoint(const ColmapPoint& from, const std::map<uint32_t, int>& view_of_image);
// Returns -1 (unknown) for a reprojection error that is not finite.
double KnownError(double error_px);

ColmapModel LoadColmapBinary(const std::filesystem::path& folder);
ColmapModel LoadColmapText(const std::filesystem::path& folder);

// Reads the times of photos, which COLMAP's model does not store, by name: a text file in COLMAP's
// style with a line "SECONDS NAME" for each photo. Names are those of the model and may contain
// blanks. Throws Error{kInvalidArgument} naming file and line for a number that is not finite, and
// for a name that is missing, repeated or has control characters.
std::map<std::string, FrameTime> LoadColmapTimes(const std::filesystem::path& file);

}  // namespace color3d
