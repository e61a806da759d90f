#include "core/scene/formats/camera_films.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/scene/formats/npy.h"
#include "tests/support/formats/npy_writer.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// Three cameras as LLFF stores them, aligned with the world except for a rotation of the last about
// z.
std::vector<double> PosesOfThree() {
  std::vector<double> rows;
  for (int i = 0; i < 3; ++i) {
    const double place = 0.5 * i;
    // Columns: down, right, backwards, position, (height, width, focal length).
    const double matrix[3][5] = {{0, 1, 0, place, 64}, {-1, 0, 0, 0.25, 96}, {0, 0, 1, 4, 120}};
    for (const auto& row : matrix) rows.insert(rows.end(), row, row + 5);
    rows.insert(rows.end(), {1.0, 10.0});
  }
  return rows;
}

class CameraFilms : public testing::Test {
 protected:
  void Touch(const std::string& name) {
    fs::create_directories((folder_.path() / name).parent_path());
    WriteFileAtomic(folder_.path() / name, "film " + name);
  }
  std::vector<CameraFilm> Read() {
    return ReadCameraFilms(folder_.path(), [](const std::string&) { return std::pair(48, 32); });
  }
  std::vector<CameraFilm> Read(const std::string& frames) {
    WriteFileAtomic(folder_.path() / "transforms.json",
                    "{\"fl_x\":60,\"w\":96,\"h\":64,\"frames\":[" + frames + "]}");
    return Read();
  }
  static std::string Frame(const std::string& file, const std::string& more = "", double x = 0.5) {
    return "{\"file_path\":\"" + file + "\"," + more + "\"transform_matrix\":[[1,0,0," +
           std::to_string(x) + "],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}";
  }
  std::string Said(const std::string& frames) {
    return Refusal([&] { Read(frames); });
  }
  std::string SaidOfPoses(const std::string& bytes) {
    WriteFileAtomic(folder_.path() / "poses_bounds.npy", bytes);
    return Refusal([&] { Read(); });
  }
  ScratchFolder folder_;
};

TEST_F(CameraFilms, ReadsTransformsJson) {
  EXPECT_TRUE(Read().empty());
  EXPECT_TRUE(Read(Frame("a.png")).empty());
  Touch("films/b.mp4");
  Touch("a.mp4");
  const auto films = Read(Frame("./films/b.mp4", "\"camera\":\"left\",") + "," +
                          Frame("a.mp4", "\"k1\":0.01,", 1.5));
  ASSERT_EQ(films.size(), 2u);
  EXPECT_EQ(films[0].camera, "a");
  EXPECT_EQ(films[0].file, "a.mp4");
  EXPECT_EQ(films[0].view.distortion.k[0], 0.01);
  EXPECT_NEAR(films[0].view.captured_camera.fx, 30.0, 1e-9);  // of the film's own size
  EXPECT_EQ(films[0].view.captured_camera.width, 48);
  EXPECT_LT((films[0].view.cam_from_world.Center() - Eigen::Vector3d(1.5, 0, 4)).norm(), 1e-12);
  EXPECT_EQ(films[0].time_offset_s, 0.0);
  EXPECT_EQ(films[1].camera, "left");
  EXPECT_EQ(films[1].file, "films/b.mp4");
  EXPECT_EQ(
      Read(Frame("a.mp4", "\"time_offset\":-1.5,") + "," + Frame("films/b.mp4"))[0].time_offset_s,
      -1.5);
}

TEST_F(CameraFilms, NamesFaultsOfTransformsJson) {
  Touch("a.mp4");
  Touch("b.mp4");
  EXPECT_THAT(Said(Frame("a.mp4") + "," + Frame("c.mp4")), HasSubstr("there is no film c.mp4"));
  EXPECT_THAT(Said(Frame("a.mp4") + "," + Frame("a.mp4", "\"camera\":\"x\",")),
              HasSubstr("names the film a.mp4 twice"));
  EXPECT_THAT(Said(Frame("a.mp4", "\"camera\":\"x\",") + "," + Frame("b.mp4", "\"camera\":\"x\",")),
              HasSubstr("two films are of the camera x"));
  EXPECT_THAT(Said(Frame("a.mp4", "\"camera\":\"../x\",") + "," + Frame("b.mp4")),
              HasSubstr("cannot be called '../x'"));
  EXPECT_THAT(Said(Frame("a.mp4") + "," + Frame("b.png")),
              HasSubstr("films or pictures, not both"));
  EXPECT_THAT(Said(Frame("a.mp4") + "," + Frame("b.mp4", "\"time\":1,")),
              HasSubstr("frame 1: b.mp4 is a film, whose frames have times of their own"));
  EXPECT_THAT(Said(Frame("a.mp4")), HasSubstr("the pose of one film"));
  // Files outside of the scene are ignored.
  EXPECT_THAT(Said(Frame("../outside/c.mp4") + "," + Frame("b.mp4")),
              HasSubstr("there is no film ../outside/c.mp4 in the scene"));
  EXPECT_THAT(Said(Frame("a.mp4", "\"h\":96,") + "," + Frame("b.mp4")), HasSubstr("96 x 96 px"));
}

TEST_F(CameraFilms, PosesBoundsRowsFollowFilmNames) {
  const std::string poses = NpyOf({3, 17}, PosesOfThree());
  WriteFileAtomic(folder_.path() / "poses_bounds.npy", poses);
  EXPECT_TRUE(Read().empty());  // LLFF's photos: not read
  for (const char* name : {"cam02.mp4", "cam00.mp4", "cam10.mp4"}) Touch(name);
  const auto films = Read();
  ASSERT_EQ(films.size(), 3u);
  EXPECT_EQ(films[1].camera, "cam02");
  const View& view = films[1].view;
  EXPECT_LT((view.cam_from_world.Center() - Eigen::Vector3d(0.5, 0.25, 4)).norm(), 1e-12);
  // Looks along -z, the world's y is up.
  EXPECT_LT((view.cam_from_world.Apply({0.5, 1.25, 0}) - Eigen::Vector3d(0, -1, 4)).norm(), 1e-12);
  EXPECT_NEAR(view.captured_camera.fx, 60.0, 1e-9);
  EXPECT_NEAR(view.camera.cy, 16.0, 1e-9);
}

TEST_F(CameraFilms, RefusesWrongPosesBounds) {
  for (const char* name : {"cam00.mp4", "cam01.mp4", "cam02.mp4"}) Touch(name);
  std::vector<double> rows = PosesOfThree();
  const std::string good = NpyOf({3, 17}, rows);
  EXPECT_EQ(SaidOfPoses(good), "");
  EXPECT_THAT(SaidOfPoses(good.substr(0, good.size() - 1)), HasSubstr("is cut short"));
  EXPECT_THAT(SaidOfPoses("Buy milk and eggs."), HasSubstr("poses_bounds.npy is no .npy file"));
  EXPECT_THAT(SaidOfPoses(NpyOf({17, 3}, rows)), HasSubstr("must have 17 columns"));
  EXPECT_THAT(SaidOfPoses(NpyOf({2, 17}, {rows.begin(), rows.begin() + 34})),
              HasSubstr("the poses of 2 cameras, but there are 3 films (cam00.mp4 to cam02.mp4)"));
  rows[17] = 1.0;  // no rotation
  EXPECT_THAT(SaidOfPoses(NpyOf({3, 17}, rows)), HasSubstr("row 1: its axes are not a rotation"));
  rows[17] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(SaidOfPoses(NpyOf({3, 17}, rows)), HasSubstr("not finite"));
  rows = PosesOfThree();
  rows[34 + 3] = 1e308;
  EXPECT_THAT(SaidOfPoses(NpyOf({3, 17}, rows)), HasSubstr("row 2: the camera stands too far"));
  rows = PosesOfThree();
  rows[34 + 14] = -5.0;
  EXPECT_THAT(SaidOfPoses(NpyOf({3, 17}, rows)),
              HasSubstr("row 2: 96 x 64 px with a focal length"));
}

TEST(Npy, ReadsOrdersAndTypes) {
  std::string bytes = NpyOf({2, 3}, {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(ReadNpy(bytes, "x.npy", 6).values, (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(ReadNpy(bytes, "x.npy", 6).shape, (std::vector<size_t>{2, 3}));
  EXPECT_THROW(ReadNpy(bytes, "x.npy", 5), Error);
  bytes.replace(bytes.find("False"), 5, "True ");
  EXPECT_EQ(ReadNpy(bytes, "x.npy", 6).values, (std::vector<double>{1, 3, 5, 2, 4, 6}));
  bytes.replace(bytes.find("<f8"), 3, "<f2");
  EXPECT_THROW(ReadNpy(bytes, "x.npy", 6), Error);
  bytes = NpyOf({2, 3}, {1, 2, 3, 4, 5, 6});
  bytes.replace(bytes.find("<f8"), 3, "<f4");
  EXPECT_EQ(ReadNpy(bytes, "x.npy", 6).values.size(), 6u);
  for (size_t n = 0; n < bytes.size(); n += 7) {
    try {
      ReadNpy(std::string_view(bytes).substr(0, n), "x.npy", 6);
    } catch (const Error&) {
    }
  }
}

TEST_F(CameraFilms, FindsFilmsWithoutPoses) {
  Touch("b.mp4");
  EXPECT_TRUE(Read().empty()) << "one film is a film";
  Touch("a.mp4");
  std::vector<CameraFilm> films = Read();
  ASSERT_EQ(films.size(), 2u);
  EXPECT_EQ(films[0].camera, "a");
  EXPECT_FALSE(films[0].has_pose || films[0].is_pictures);
  const auto unposed = [](const std::string& file, const std::string& more) {
    return "{\"file_path\":\"" + file + "\"" + more + "}";
  };
  films = Read(unposed("a.mp4", "") + "," + unposed("b.mp4", ",\"time_offset\":0.25"));
  ASSERT_EQ(films.size(), 2u);
  EXPECT_FALSE(films[1].has_pose);
  EXPECT_EQ(films[1].time_offset_s, 0.25);
  EXPECT_THAT(Said(unposed("a.mp4", "") + "," + Frame("b.mp4")),
              HasSubstr("a.mp4 has no transform_matrix, but others have one"));
  EXPECT_THAT(Said(unposed("a.mp4", "")), HasSubstr("names one film; colour it as a film"));
  fs::remove(folder_.path() / "transforms.json");
  Touch("photo.png");
  EXPECT_TRUE(Read().empty()) << "photos are the scene";
}

TEST_F(CameraFilms, FoldersOfPicturesAreCameras) {
  Touch("frames/left/1.png");
  EXPECT_TRUE(Read().empty()) << "one folder is a film";
  Touch("frames/right/1.png");
  const std::vector<CameraFilm> films = Read();
  ASSERT_EQ(films.size(), 2u);
  EXPECT_EQ(films[1].camera, "right");
  EXPECT_EQ(films[1].file, "frames/right");
  EXPECT_TRUE(films[1].is_pictures && !films[1].has_pose);
  Touch("frames/2.png");
  EXPECT_THAT(Refusal([&] { Read(); }), HasSubstr("frames/2.png lies beside the folder frames/"));
}

TEST_F(CameraFilms, NamesCopiesOfFilms) {
  Touch("a.mp4");
  Touch("b.mp4");
  fs::copy_file(folder_.path() / "a.mp4", folder_.path() / "c (1).mp4");
  EXPECT_THAT(Refusal([&] { Read(); }),
              HasSubstr("a.mp4 and c (1).mp4 are the same film, byte for byte"));
  EXPECT_THAT(Said(Frame("c (1).mp4") + "," + Frame("a.mp4")), HasSubstr("are the same film"));
  fs::remove(folder_.path() / "c (1).mp4");
  fs::remove(folder_.path() / "transforms.json");
  EXPECT_EQ(Read().size(), 2u);
}

TEST_F(CameraFilms, NamesCopiesOfFolders) {
  for (const char* frame : {"1.png", "2.png"}) {
    Touch(std::string("frames/left/") + frame);
    fs::create_directories(folder_.path() / "frames/right");
    fs::copy_file(folder_.path() / "frames/left" / frame, folder_.path() / "frames/right" / frame);
  }
  EXPECT_THAT(Refusal([&] { Read(); }),
              HasSubstr("frames/left and frames/right are the same film"));
  WriteFileAtomic(folder_.path() / "frames/right/2.png", std::string("film frames/left/3.png"));
  EXPECT_EQ(Read().size(), 2u);
}

}  // namespace
}  // namespace color3d
