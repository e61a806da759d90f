// A page that plays, in a real browser, against our own renderer.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/splat/export/motion/playable_scene.h"
#include "core/splat/export/sog/sog.h"
#include "core/splat/motion/geometry_in_time.h"
#include "core/splat/raster/render.h"
#include "core/video/mp4_writer.h"
#include "core/view/browser_fixture.h"
#include "tests/support/formats/sound_film.h"

namespace color3d {
namespace {

constexpr int kStageWidth = 480, kStageHeight = 320;
constexpr int kTimeSteps = 5;
constexpr int kStopsOfStep = 10;  // of the slider, player.js
constexpr double kEndS = 2.0;

void AddGaussian(const Eigen::Vector3f& at,
                 const Eigen::Vector3f& size,
                 const Eigen::Quaternionf& rotation,
                 float light,
                 float a,
                 float b,
                 GaussianModel* model) {
  model->position.insert(model->position.end(), {at.x(), at.y(), at.z()});
  for (int k = 0; k < 3; ++k) model->log_scale.push_back(std::log(size[k]));
  model->rotation.insert(model->rotation.end(),
                         {rotation.w(), rotation.x(), rotation.y(), rotation.z()});
  model->opacity_logit.push_back(3.0f);
  const float dc = 0.28209479f;
  model->sh_l.push_back((light - 0.5f) / dc);
  model->sh_a.push_back(a / dc);
  model->sh_b.push_back(b / dc);
  model->confidence.push_back(0.5f);
}

// A chequered wall. Before it a bar falls along a parabola and turns, a disc crosses behind another
// one, which comes near, and a patch shines up in the middle of the time.
GaussianModel MovingThings() {
  GaussianModel model;
  model.channels = 3;
  const Eigen::Quaternionf upright = Eigen::Quaternionf::Identity();
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 36; ++x) {
      const bool dark = (x / 4 + y / 4) % 2 == 0;
      // Neighbours differ in depth, or every renderer could draw them in an order of its own.
      const float depth = 5.0f + 0.01f * static_cast<float>((7 * x + 3 * y) % 41);
      AddGaussian({0.2f * (x - 17.5f), 0.2f * (y - 11.5f), depth},
                  {0.11f, 0.11f, 0.02f},
                  upright,
                  dark ? 0.35f : 0.65f,
                  dark ? 0.03f : -0.02f,
                  dark ? -0.04f : 0.05f,
                  &model);
    }
  }
  GaussianMotion& motion = model.motion;
  motion.end_s = kEndS;
  const auto move = [&](const Eigen::Vector3f& velocity,
                        const Eigen::Vector3f& acceleration,
                        const Eigen::Vector4f& spin,
                        float center,
                        float width) {
    motion.velocity.insert(motion.velocity.end(), velocity.data(), velocity.data() + 3);
    motion.acceleration.insert(
        motion.acceleration.end(), acceleration.data(), acceleration.data() + 3);
    motion.spin.insert(motion.spin.end(), spin.data(), spin.data() + 4);
    motion.center.push_back(center);
    motion.log_width.push_back(std::log(width));
  };
  AddGaussian({-1.2f, 0.2f, 3.5f}, {0.5f, 0.12f, 0.1f}, upright, 0.7f, 0.08f, 0.06f, &model);
  move({0.3f, 0.5f, 0.0f}, {0.0f, 0.6f, 0.0f}, {0.0f, 0.0f, 0.0f, 0.6f}, 0.0f, 20.0f);
  const Eigen::Quaternionf tilted(Eigen::AngleAxisf(0.5f, Eigen::Vector3f::UnitZ()));
  AddGaussian({0.8f, -0.6f, 3.0f}, {0.3f, 0.2f, 0.1f}, tilted, 0.4f, -0.08f, 0.05f, &model);
  move({-0.9f, 0.0f, -0.4f}, {0.0f, 0.0f, 0.0f}, {0.1f, 0.0f, 0.3f, 0.0f}, 0.0f, 20.0f);
  AddGaussian({0.0f, -0.5f, 3.2f}, {0.25f, 0.25f, 0.1f}, upright, 0.7f, 0.0f, 0.09f, &model);
  move({0.7f, 0.1f, 0.6f}, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f, 0.0f}, 0.0f, 20.0f);
  AddGaussian({1.3f, 0.9f, 3.4f}, {0.35f, 0.35f, 0.1f}, upright, 0.75f, -0.03f, -0.07f, &model);
  move({0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f, 0.0f}, 0.1f, 0.3f);
  return model;
}

double TimeOfStep(int step) { return kEndS * step / (kTimeSteps - 1); }

// One standing camera, a photo each time step.
Scene SceneInTime() {
  Scene scene;
  for (int i = 0; i < kTimeSteps; ++i) {
    View view;
    view.name = fmt::format("{}.jpg", i);
    view.camera = {kStageWidth, kStageHeight, 420.0, 420.0, kStageWidth / 2.0, kStageHeight / 2.0};
    view.cam_from_world.rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.02 * i, Eigen::Vector3d::UnitY()));
    view.moment = Moment{TimeOfStep(i), 0};
    scene.views.push_back(view);
  }
  return scene;
}

double PsnrOf(const Image& a, const Image& b) {
  double squares = 0.0;
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < a.height; ++y) {
      for (int x = 0; x < a.width; ++x) {
        const double d = a.At(c, y, x) - b.At(c, y, x);
        squares += d * d;
      }
    }
  }
  return -10.0 * std::log10(squares / (3.0 * a.width * a.height));
}

class ViewMotionTest : public BrowserFixture {
 protected:
  ViewPage PageAt(double shown_s) const {
    ViewPage page;
    page.file_name = "scene.sog";
    page.file_is_compressed = true;
    page.focus = {0.0, 0.0, 3.0};
    page.poster = EncodeJpeg(Image(kStageWidth, kStageHeight, 3, 0.5f));
    page.photos = {{0, EncodeJpeg(Image(kStageWidth, kStageHeight, 3, 0.5f))}};
    page.motion.emplace().shown_s = shown_s;
    return page;
  }

  std::string Write(const ViewPage& page) {
    const std::string file = scratch_.path() / "view.html";
    WriteFileAtomic(file, RenderViewPage(scene_, page));
    return file;
  }

  nlohmann::json Play(const std::string& page, const std::vector<std::string>& stops) {
    std::vector<std::string> arguments = {
        pictures_, std::to_string(kStageWidth), std::to_string(kStageHeight)};
    arguments.insert(arguments.end(), stops.begin(), stops.end());
    return RunInBrowser(COLOR3D_PLAY_PAGE, page, arguments);
  }

  // Grey pictures with a tone, as long as the motion.
  ViewPageMovie Film() {
    const auto silent = scratch_.path() / "silent.mp4", film = scratch_.path() / "film.mp4";
    Mp4Writer writer(silent, {.width = 64, .height = 48, .frames_per_second = 10});
    for (int i = 0; i < 21; ++i) writer.Add(Image(64, 48, 3, 0.5f), pool_);
    writer.Finish();
    AddSound(silent,
             {.seconds = 2.1, .level = [](double t) { return 0.3 * std::sin(2765.0 * t); }},
             film);
    return {ReadFile(film), true, true};
  }

  Image Seen(const std::string& name) const {
    return DecodeImage(ReadFile(pictures_ + "/" + name + ".png"), name + ".png");
  }

  // From the key view, with the browser's own share of the difference left out: colours of SOG.
  Image Ours(double time_s) {
    const View& key = scene_.views[0];
    return SrgbFromLab(RenderView(model_, key.camera, key.cam_from_world, pool_, 0.0f, time_s).lab);
  }

  const GaussianModel model_ = MovingThings();
  const Scene scene_ = SceneInTime();
  ThreadPool pool_{2};
  // COLOR3D_PICTURES: a folder in which the pictures stay, to be looked at.
  const char* const kept_ = std::getenv("COLOR3D_PICTURES");
  const std::string pictures_ = kept_ != nullptr ? kept_ : (scratch_.path() / "pictures").string();
};

TEST_F(ViewMotionTest, PlaysAsOurRendererDraws) {
  const RgbHarmonics rgb = FitRgbHarmonics(model_, pool_);
  const PlayableScene playable = EncodePlayable(model_, rgb, {}, pool_);
  ViewPage page = PageAt(TimeOfStep(1));
  page.file_bytes = playable.sog;
  page.confidence = playable.confidence;
  page.motion->file = playable.motion;
  page.motion->seconds = kEndS;
  page.motion->steps = kTimeSteps;
  page.motion->film = {0, 1, 2, 3, 4};
  page.movie = Film();
  const std::vector<int> steps = {0, 1, 2, 4};
  std::vector<std::string> stops;
  for (const int step : steps) stops.push_back(std::to_string(kStopsOfStep * step));
  const nlohmann::json played = Play(Write(page), stops);
  SCOPED_TRACE(played.dump(1));
  ASSERT_EQ(played.at("state"), "ready");
  EXPECT_TRUE(played.at("errors").empty());
  EXPECT_TRUE(played.at("requests").empty());
  EXPECT_EQ(played.at("opened_at"), "0.50 / 2.00 s");
  EXPECT_EQ(played.at("clocks"),
            (nlohmann::json{"0.00 / 2.00 s", "0.50 / 2.00 s", "1.00 / 2.00 s", "2.00 / 2.00 s"}));
  EXPECT_EQ(played.at("keys").at("frame_steps"), kStopsOfStep);
  EXPECT_EQ(played.at("keys").at("space_plays"), "true");
  EXPECT_EQ(played.at("keys").at("space_pauses"), "false");
  EXPECT_EQ(played.at("keys").at("pause_holds"), true);
  EXPECT_GE(played.at("loops"), 8);
  const auto& heard = played.at("heard");
  EXPECT_EQ(heard.at("plays"), true);
  EXPECT_GT(heard.at("level"), 0.05);
  EXPECT_NEAR(heard.at("hz"), 2765.0 / (2.0 * M_PI), 30.0);
  EXPECT_LT(heard.at("largest_apart"), 0.3);  // seconds, on a busy machine; kApart of player.js
  EXPECT_GT(heard.at("scrubbed_to"), 0.2);
  EXPECT_LT(heard.at("after_scrub"), 0.1);
  EXPECT_LT(heard.at("played_after_scrub"), 0.1);
  EXPECT_EQ(heard.at("stops"), true);
  const double before = played.at("heap").at(0), after = played.at("heap").at(1);
  EXPECT_LT(after, 1.05 * before + 500'000);

  // A still page of the same moment has the viewer's own differences: blending and SOG.
  for (size_t i = 0; i < steps.size(); ++i) {
    const double time_s = TimeOfStep(steps[i]);
    const Image ours = Ours(time_s);
    WriteFileAtomic(pictures_ + "/ours_" + stops[i] + ".png", EncodePng8(ours));
    const double moving = PsnrOf(Seen(stops[i]), ours);
    RecordProperty("psnr_db_" + stops[i], std::to_string(moving));
    EXPECT_GE(moving, 30.0) << time_s;
    if (i == 0) continue;
    EXPECT_LT(PsnrOf(Seen(stops[i]), Ours(TimeOfStep(steps[i - 1]))), 28.0) << time_s;
  }
  const GaussianModel still = ModelAt(model_, TimeOfStep(2), pool_);
  ViewPage still_page = PageAt(0.0);
  still_page.motion.reset();
  still_page.file_bytes =
      EncodeSog(ForViewers(still, FitRgbHarmonics(still, pool_), {}, pool_), pool_);
  const nlohmann::json looked = Play(Write(still_page), {});
  ASSERT_EQ(looked.at("state"), "ready");
  const double standing = PsnrOf(Seen("still"), Ours(TimeOfStep(2)));
  RecordProperty("psnr_db_still", std::to_string(standing));
  EXPECT_GE(PsnrOf(Seen(stops[2]), Ours(TimeOfStep(2))), standing - 1.0);
}

}  // namespace
}  // namespace color3d
