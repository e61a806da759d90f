// COLMAP's sparse model as its files hold it, before it becomes a Scene. For this folder only.
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

// True when the folder has a cameras.bin or cameras.txt.
bool IsColmapFolder(const std::filesystem::path& folder);

// Binary where all three files are, else text. Throws Error{kInvalidArgument} naming file and
// place for anything that is cut short, inconsistent or not finite.
ColmapModel LoadColmapModel(const std::filesystem::path& folder);

// Shared by the two readers. `model` is COLMAP's name ("SIMPLE_RADIAL"); `place` opens the message.
int ColmapParameterCount(const std::string& model, const std::string& place);
std::string ColmapModelName(int model_id, const std::string& place);
ColmapCamera MakeColmapCamera(const std::string& model,
                              uint64_t width,
                              uint64_t height,
                              const std::vector<double>& parameters,
                              const std::string& place);
// Normalises the quaternion; refuses zero and non-finite ones.
Pose MakeColmapPose(const double (&qvec_wxyz)[4],
                    const double (&tvec)[3],
                    const std::string& place);
// Refuses control characters, which would break lines of messages and logs.
void CheckColmapName(const std::string& name, const std::string& place);
void CheckColmapPoint(const ColmapPoint& point, const std::string& place);
// -1, unknown, for a reprojection error that is not finite.
double KnownError(double error_px);

ColmapModel LoadColmapBinary(const std::filesystem::path& folder);
ColmapModel LoadColmapText(const std::filesystem::path& folder);

// What COLMAP does not keep: when its photos were taken. A text file as COLMAP's are, with a line
// "SECONDS NAME" for each photo; the name, as the model has it, may hold blanks. By name. Throws
// Error{kInvalidArgument} naming file and line: no finite number, no name, a name that is there
// twice or holds control characters.
std::map<std::string, FrameTime> LoadColmapTimes(const std::filesystem::path& file);

}  // namespace color3d
