// Tests of the public interface: train, colorize, store, load.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/colorizer/corrector.h"
#include "core/colorizer/personal/train_colorizer.h"

namespace color3d {
namespace {

struct Key {
  Image luminance;
  Image ab;
};

// Horizontal stripes are orange, vertical ones blue.
Key MakeKey(int width, int height) {
  Key key{Image(width, height, 1), Image(width, height, 2)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool left = 2 * x < width;
      key.luminance.At(0, y, x) = 50.0f + 20.0f * std::sin(0.8f * (left ? y : x));
      key.ab.At(0, y, x) = left ? 30.0f : 5.0f;
      key.ab.At(1, y, x) = left ? 40.0f : -45.0f;
    }
  }
  return key;
}

ColorizerOptions Quick(int iterations) {
  ColorizerOptions options;
  options.iterations = iterations;
  options.crop_px = 64;
  return options;
}

// Trained once, since training is slow.
const std::shared_ptr<const Encoder>& TheEncoder() {
  static const std::shared_ptr<const Encoder> encoder = Encoder::Embedded();
  return encoder;
}

std::shared_ptr<const Colorizer> Train(const Key& key, const ColorizerOptions& options) {
  ThreadPool pool(1);
  NoCheckpoints checkpoints;
  NullObserver progress;
  return TrainColorizer(
      TheEncoder(), {{"key", key.luminance, key.ab}}, options, {pool, checkpoints, progress, {}});
}

double MeanError(const Image& luminance, const Image& x, const Image& y) {
  return MeanDeltaE00(JoinLab(luminance, x), JoinLab(luminance, y));
}

void ExpectRefused(const std::string& bytes, ErrorCode code = ErrorCode::kInvalidArgument) {
  try {
    LoadColorizer(bytes, TheEncoder(), 1);
    FAIL() << "was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
  }
}

struct OtherEncoder : Encoder {
  const std::string& digest() const override { return name; }
  const std::string& description() const override { return name; }
  std::vector<double> Describe(const Image&) const override { return {1.0}; }
  Image DeepFeatures(const Image&) const override { return Image(1, 1, 1); }
  std::string name = "other";
};

TEST(ColorizerTest, LearnsTheKeyView) {
  const Key key = MakeKey(128, 96);
  const double gray = MeanError(key.luminance, key.ab, Image(128, 96, 2));
  const double neighbors =
      MeanError(key.luminance, key.ab, Train(key, Quick(0))->Colorize(key.luminance));
  const double trained =
      MeanError(key.luminance, key.ab, Train(key, Quick(40))->Colorize(key.luminance));
  EXPECT_GT(gray, 15.0);
  EXPECT_LT(neighbors, 0.25 * gray);
  EXPECT_LT(trained, 0.25 * gray);
}

struct ErrorNames : NullObserver {
  void OnError(int64_t, const std::string& name, double) override { names.insert(name); }
  std::set<std::string> names;
};

// The second picture has stripes of both directions, whose colour is uncertain, and is coloured in
// its left half alone.
TEST(ColorizerTest, TrainsDecoderOnlyAboveItsLeastShare) {
  const Key key = MakeKey(96, 64);
  Image left(96, 64, 1);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 48; ++x) left.At(0, y, x) = 1.0f;
  }
  Image stripes(96, 64, 1);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 96; ++x) {
      stripes.At(0, y, x) = 50.0f + 10.0f * (std::sin(0.8f * x) + std::sin(0.8f * y));
    }
  }
  const TrainingPicture view{"view", stripes, key.ab, left};
  ErrorNames seen;
  const auto colors = [&](int iterations, double least_share, bool has_view) {
    std::vector<TrainingPicture> pictures = {{"key", key.luminance, key.ab}};
    if (has_view) pictures.push_back(view);
    ColorizerOptions options = Quick(iterations);
    options.min_decoder_share = least_share;
    seen.names.clear();
    ThreadPool pool(1);
    NoCheckpoints checkpoints;
    return TrainColorizer(TheEncoder(), pictures, options, {pool, checkpoints, seen, {}})
        ->Colorize(stripes)
        .data;
  };
  const auto untrained = colors(0, 0.0, true), trained = colors(10, 0.0, true);
  ASSERT_NE(untrained, trained);
  EXPECT_FALSE(seen.names.contains(kDecoderShareName));
  EXPECT_EQ(colors(10, 1.0, true), untrained);
  EXPECT_TRUE(seen.names.contains(kDecoderShareName));
  EXPECT_TRUE(seen.names.contains("validation_delta_e00"));
  EXPECT_FALSE(seen.names.contains("train_l1_ab"));
  EXPECT_EQ(colors(10, 1e-12, true), trained);
  EXPECT_NE(colors(10, 0.99, false), colors(0, 0.0, false)) << "unknown: it is trained";
}

TEST(ColorizerTest, RestoresSameColorizerFromFile) {
  const Key key = MakeKey(96, 80);
  ColorizerOptions paper;
  paper.UsePaperRecipe();
  paper.elastic.alpha_px = 34.0;
  ColorizerOptions old_paper;  // of files of earlier versions
  old_paper.recipe = ColorizerOptions::Recipe::kPaper;
  old_paper.instance_norm = true;
  for (ColorizerOptions options : {ColorizerOptions(), paper, old_paper}) {
    options.iterations = 3;
    options.crop_px = 64;
    const auto trained = Train(key, options);
    const std::string bytes = trained->Serialize();
    const auto loaded = LoadColorizer(bytes, TheEncoder(), 1);
    EXPECT_EQ(loaded->Colorize(key.luminance).data, trained->Colorize(key.luminance).data);
    EXPECT_EQ(loaded->Serialize(), bytes);
  }
}

TEST(ColorizerTest, DefaultFileHasNoLaterOptions) {
  const std::string bytes = Train(MakeKey(64, 64), Quick(0))->Serialize();
  for (const char* name : {"elastic", "equal_draws", "full_resolution", "max_gradient_norm"}) {
    EXPECT_EQ(bytes.find(name), std::string::npos) << name;
  }
}

TEST(ColorizerTest, EqualDrawsIgnoreShares) {
  const Key key = MakeKey(96, 80);
  TrainingPicture other{"other", key.luminance, Image(96, 80, 2, 20.0f)};
  other.share = 0.0;
  ColorizerOptions options = Quick(20);
  options.neighbors = false;
  const auto trained = [&](bool equal_draws) {
    options.equal_draws = equal_draws;
    ThreadPool pool(1);
    NoCheckpoints checkpoints;
    NullObserver progress;
    return TrainColorizer(TheEncoder(),
                          {{"key", key.luminance, key.ab}, other},
                          options,
                          {pool, checkpoints, progress, {}})
        ->Colorize(key.luminance);
  };
  const double without = MeanError(key.luminance, key.ab, trained(false));
  EXPECT_GT(MeanError(key.luminance, key.ab, trained(true)), 1.1 * without);
}

TEST(ColorizerTest, FullSizeDoesNotReducePictures) {
  ColorizerOptions options = Quick(3);
  options.max_side_px = 96;
  const std::string bytes = Train(MakeKey(96, 80), options)->Serialize();
  const auto answer = [&](const Image& luminance, bool full_size) {
    const PredictionOptions prediction{.full_size = full_size};
    return LoadColorizer(bytes, TheEncoder(), 1, prediction)->Colorize(luminance).data;
  };
  const Image small = MakeKey(64, 96).luminance, large = MakeKey(192, 160).luminance;
  EXPECT_EQ(answer(small, true), answer(small, false));
  EXPECT_NE(answer(large, true), answer(large, false));
}

TEST(ColorizerTest, FeedForwardRecipeTrainsNothing) {
  const Key key = MakeKey(96, 80);
  ColorizerOptions options = Quick(20);
  options.recipe = ColorizerOptions::Recipe::kFeedForward;
  const auto general = Train(key, options);
  const std::string bytes = general->Serialize();
  options.iterations = 0;
  EXPECT_EQ(Train(key, options)->Serialize(), bytes) << "iterations are ignored";
  const Image ab = general->Colorize(key.luminance);
  EXPECT_EQ(LoadColorizer(bytes, TheEncoder(), 1)->Colorize(key.luminance).data, ab.data);
  EXPECT_NE(Train(key, Quick(0))->Colorize(key.luminance).data, ab.data) << "the head corrects";
  const double gray = MeanError(key.luminance, key.ab, Image(96, 80, 2));
  EXPECT_LT(MeanError(key.luminance, key.ab, ab), 0.4 * gray);
}

TEST(ColorizerTest, FileKeepsNetworkSize) {
  const Key key = MakeKey(96, 80);
  ColorizerOptions options = Quick(3);
  options.adapter_stages = 1;
  const size_t usual = Train(key, options)->Serialize().size();
  options.decoder_width = 0.5;
  const auto trained = Train(key, options);
  const std::string bytes = trained->Serialize();
  EXPECT_LT(bytes.size(), usual);
  EXPECT_NE(bytes.find("adapters.4."), std::string::npos);
  EXPECT_EQ(bytes.find("adapters.3."), std::string::npos) << "only the deepest stage has them";
  EXPECT_EQ(LoadColorizer(bytes, TheEncoder(), 1)->Colorize(key.luminance).data,
            trained->Colorize(key.luminance).data);
}

TEST(ColorizerTest, RefusesNetworkSizeOutOfRange) {
  ColorizerOptions options;
  options.adapter_stages = 9;
  EXPECT_THROW(options.Validate(), Error);
  options.adapter_stages = 8;
  options.decoder_width = 0.1;
  EXPECT_THROW(options.Validate(), Error);
}

TEST(ColorizerTest, IsRepeatableForSameSeed) {
  const Key key = MakeKey(96, 80);
  ColorizerOptions options = Quick(5);
  // Without neighbors, since their colours do not depend on the seed.
  options.recipe = ColorizerOptions::Recipe::kPaper;
  const Image first = Train(key, options)->Colorize(key.luminance);
  EXPECT_EQ(Train(key, options)->Colorize(key.luminance).data, first.data);
  options.seed = 2;
  EXPECT_NE(Train(key, options)->Colorize(key.luminance).data, first.data);
}

TEST(ColorizerTest, ColorizesPicturesOfAnySize) {
  const auto colorizer = Train(MakeKey(96, 80), Quick(1));
  Random random(1);
  for (const auto& [width, height] :
       {std::pair{1, 1}, {1, 50}, {33, 31}, {401, 299}, {900, 600}, {2000, 3}}) {
    Image luminance(width, height, 1);
    for (float& value : luminance.data) value = static_cast<float>(random.NextUniform(0.0, 100.0));
    const Image ab = colorizer->Colorize(luminance);
    ASSERT_EQ(ab.width, width);
    ASSERT_EQ(ab.height, height);
    ASSERT_EQ(ab.channels, 2);
    for (float value : ab.data) ASSERT_TRUE(std::isfinite(value) && std::abs(value) < 500.0f);
  }
  for (float l : {0.0f, 50.0f, 100.0f}) {
    for (float value : colorizer->Colorize(Image(64, 64, 1, l)).data) {
      ASSERT_TRUE(std::isfinite(value));
    }
  }
}

TEST(ColorizerTest, RefusesBadPictures) {
  const auto colorizer = Train(MakeKey(96, 80), Quick(0));
  EXPECT_THROW(colorizer->Colorize(Image(4, 4, 3)), Error);
  EXPECT_THROW(colorizer->Colorize(Image()), Error);
  Image broken(8, 8, 1, 50.0f);
  broken.data[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(colorizer->Colorize(broken), Error);
}

TEST(ColorizerTest, GivesSameColorsOnSeveralThreads) {
  const Key key = MakeKey(96, 80);
  const auto colorizer = Train(key, Quick(2));
  const Image expected = colorizer->Colorize(key.luminance);
  std::vector<Image> answers(4);
  std::vector<std::thread> threads;
  for (Image& answer : answers) {
    threads.emplace_back([&] { answer = colorizer->Colorize(key.luminance); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const Image& answer : answers) {
    for (size_t i = 0; i < expected.data.size(); ++i) {
      ASSERT_NEAR(answer.data[i], expected.data[i], 1e-2f);
    }
  }
}

TEST(ColorizerTest, RefusesDamagedFiles) {
  const std::string bytes = Train(MakeKey(64, 64), Quick(0))->Serialize();
  ExpectRefused("");
  ExpectRefused("C3DCOLR1");
  ExpectRefused(std::string(200, 'x'));
  for (size_t length : {size_t{20}, bytes.size() / 2, bytes.size() - 1}) {
    ExpectRefused(bytes.substr(0, length));
  }
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    std::string changed = bytes;
    changed[random.NextBelow(static_cast<uint32_t>(bytes.size()))] ^= 0x10;
    ExpectRefused(changed);
  }
}

TEST(ColorizerTest, ForOtherSceneForgetsPositions) {
  const Key key = MakeKey(96, 80);
  // Positions grow with x in the scene of the colorizer, and fall in the other one.
  Image here(96, 80, 4, 1.0f), there(96, 80, 4, 1.0f);
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 96; ++x) {
      here.At(0, y, x) = 0.02f * x;
      there.At(0, y, x) = 0.02f * (95 - x);
    }
  }
  ThreadPool pool(1);
  NoCheckpoints checkpoints;
  NullObserver progress;
  const CancellationToken cancel;
  TrainingPicture picture{"key", key.luminance, key.ab};
  picture.position = here;
  const std::string bytes =
      TrainColorizer(TheEncoder(), {picture}, Quick(0), {pool, checkpoints, progress, cancel})
          ->Serialize();
  const auto colors = [&](const std::string& file, const Image& position) {
    return LoadColorizer(file, TheEncoder(), 1)->Predict(key.luminance, {{}, position}).ab.data;
  };
  EXPECT_NE(colors(bytes, there), colors(bytes, {}));
  const std::string other = ColorizerForOtherScene(bytes, TheEncoder());
  EXPECT_EQ(colors(other, there), colors(bytes, {}));
  EXPECT_THROW(ColorizerForOtherScene(bytes.substr(1), TheEncoder()), Error);
  EXPECT_THROW(ColorizerForOtherScene(bytes, std::make_shared<OtherEncoder>()), Error);
}

TEST(ColorizerTest, CorrectsByCellsThatWereKept) {
  const Key key = MakeKey(96, 72);
  const auto colorizer = Train(key, Quick(0));
  Correction correction{{key.luminance, key.ab, {}, {}}, key.ab, Image(96, 72, 1), 1.0};
  for (int y = 20; y < 40; ++y) {
    for (int x = 20; x < 60; ++x) {
      correction.painted.At(0, y, x) = 1.0f;
      correction.ab.At(0, y, x) += 30.0f;
    }
  }
  const auto corrector = colorizer->Correct({&correction, 1});
  const PictureCells cells = corrector->Describe(key.luminance, {});
  const std::string bytes = SerializePictureCells(cells);
  const auto kept = ParsePictureCells(bytes);
  ASSERT_TRUE(kept);
  const CorrectedColor fresh = corrector->Predict(correction.picture, 5);
  const CorrectedColor again = corrector->Predict(correction.picture, *kept, 5);
  EXPECT_EQ(again.change.data, fresh.change.data);
  EXPECT_EQ(again.share.data, fresh.share.data);
  EXPECT_EQ(again.sample.features, fresh.sample.features);
  EXPECT_GT(*std::ranges::max_element(fresh.share.data), 0.5f);
  EXPECT_TRUE(corrector->Predict(correction.picture, *kept, 0).sample.places.empty());
  EXPECT_FALSE(ParsePictureCells(""));
  EXPECT_FALSE(ParsePictureCells(bytes.substr(0, bytes.size() - 1)));
  EXPECT_FALSE(ParsePictureCells(bytes.substr(0, bytes.size() / 2)));
  const Key other = MakeKey(64, 64);
  EXPECT_THROW(corrector->Predict({other.luminance, other.ab, {}, {}}, *kept, 0), Error);
}

TEST(ColorizerTest, RefusesOtherEncoder) {
  const Key key = MakeKey(64, 64);
  const std::string bytes = Train(key, Quick(0))->Serialize();
  EXPECT_THROW(LoadColorizer(bytes, std::make_shared<OtherEncoder>()), Error);
  EXPECT_THROW(LoadColorizer(bytes, nullptr), Error);
  ThreadPool pool(1);
  NoCheckpoints checkpoints;
  NullObserver progress;
  const CancellationToken cancel;
  const RunControl control{pool, checkpoints, progress, cancel};
  EXPECT_THROW(
      TrainColorizer(
          std::make_shared<OtherEncoder>(), {{"key", key.luminance, key.ab}}, Quick(0), control),
      Error);
}

TEST(ColorizerTest, RefusesBadOptionsAndKeyViews) {
  const Key key = MakeKey(64, 64);
  auto refused = [&](auto change) {
    ColorizerOptions options = Quick(0);
    change(options);
    EXPECT_THROW(Train(key, options), Error);
  };
  refused([](ColorizerOptions& o) { o.iterations = -1; });
  refused([](ColorizerOptions& o) { o.iterations = 100001; });
  refused([](ColorizerOptions& o) { o.max_side_px = 63; });
  refused([](ColorizerOptions& o) { o.crop_px = 2000; });
  refused([](ColorizerOptions& o) { o.consistency_weight = -1.0; });
  refused([](ColorizerOptions& o) { o.time_limit_seconds = std::nan(""); });
  EXPECT_THROW(Train({Image(64, 64, 1), Image(63, 64, 2)}, Quick(0)), Error);
  EXPECT_THROW(Train({Image(64, 64, 3), Image(64, 64, 2)}, Quick(0)), Error);
  Key broken = key;
  broken.ab.data[9] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(Train(broken, Quick(0)), Error);
}

TEST(ColorizerTest, TrainsOnDegenerateKeyViews) {
  for (const auto& [width, height] : {std::pair{1, 1}, {64, 64}, {7, 200}}) {
    const Key flat{Image(width, height, 1, 50.0f), Image(width, height, 2, 20.0f)};
    const Image ab = Train(flat, Quick(2))->Colorize(flat.luminance);
    for (float value : ab.data) ASSERT_NEAR(value, 20.0f, 4.0f) << width << "x" << height;
  }
}

}  // namespace
}  // namespace color3d
