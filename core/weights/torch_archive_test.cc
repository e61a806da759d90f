#include "core/weights/torch_archive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/weights/weight_file.h"
#include "tests/support/networks/weight_files.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

WeightMap Parse(const std::string& bytes) { return ReadWeights(MemorySource(bytes, "f.pth")); }

std::string RefusalOf(const std::string& bytes) {
  try {
    Parse(bytes);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument) << error.what();
    EXPECT_THAT(error.what(), ::testing::StartsWith("f.pth: "));
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "accepted";
}

WeightMap SomeWeights() {
  return {{"a.weight", {{2, 3}, {1.0f, -2.5f, 0.0f, 4.0f, 640.0f, -3.0f}}},
          {"b", {{}, {7.0f}}},
          {"empty", {{0, 4}, {}}}};
}

// An archive with the pickle and one storage "0" of `floats` zeros.
std::string Archive(const std::string& pickle, size_t floats = 6) {
  std::string values;
  for (size_t i = 0; i < floats; ++i) {
    const auto value = static_cast<float>(i);
    values.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  return MakeZip({{"m/data.pkl", pickle}, {"m/data/0", values}, {"m/version", "3\n"}});
}

// A state dict whose only entry "w" is the tensor.
std::string OneTensor(int64_t count,
                      int64_t offset,
                      const std::vector<int64_t>& shape,
                      const std::vector<int64_t>& strides,
                      const std::string& key = "0") {
  PickleWriter pickle;
  pickle.Op('}').Text("w").Tensor("FloatStorage", key, count, offset, shape, strides).Op('s');
  return Archive(pickle.Finish());
}

void ExpectSame(const WeightMap& read, const WeightMap& expected, const std::string& what) {
  ASSERT_EQ(read.size(), expected.size()) << what;
  for (const auto& [name, array] : expected) {
    ASSERT_EQ(read.count(name), 1u) << what << " " << name;
    EXPECT_EQ(read.at(name).shape, array.shape) << what << " " << name;
    EXPECT_EQ(read.at(name).values, array.values) << what << " " << name;
  }
}

TEST(TorchArchiveTest, ReadsStateDictsOfAllLayouts) {
  for (const char* wrapper : {"", "params", "params_ema", "model", "state_dict"}) {
    for (bool with_metadata : {false, true}) {
      for (const char* type : {"FloatStorage", "HalfStorage", "BFloat16Storage", "DoubleStorage"}) {
        ExpectSame(Parse(MakeStateDict(SomeWeights(), {wrapper, type, with_metadata})),
                   SomeWeights(),
                   std::string(wrapper) + " " + type);
      }
    }
  }
  const WeightMap counters{{"bn.num_batches_tracked", {{}, {12345.0f}}}};
  ExpectSame(Parse(MakeStateDict(counters, {"", "LongStorage"})), counters, "int64");
}

TEST(TorchArchiveTest, ReadsZip64Archives) {
  PickleWriter pickle;
  pickle.Op('}').Text("w").Tensor("FloatStorage", "0", 1, 0, {1}, {1}).Op('s');
  const std::string bytes =
      MakeZip({{"m/data.pkl", pickle.Finish()}, {"m/data/0", std::string(4, '\0')}},
              {.alignment = 64, .zip64 = true});
  ExpectSame(Parse(bytes), {{"w", {{1}, {0.0f}}}}, "zip64");
}

TEST(TorchArchiveTest, ViewsBecomeContiguous) {
  EXPECT_EQ(Parse(OneTensor(6, 0, {3, 2}, {1, 3})).at("w").values,
            (std::vector<float>{0, 3, 1, 4, 2, 5}));
  EXPECT_EQ(Parse(OneTensor(6, 1, {2}, {3})).at("w").values, (std::vector<float>{1, 4}));
  EXPECT_EQ(Parse(OneTensor(6, 5, {2, 2}, {0, 0})).at("w").values,
            (std::vector<float>{5, 5, 5, 5}));
  EXPECT_EQ(Parse(OneTensor(6, 4, {1, 2}, {77, 1})).at("w").values, (std::vector<float>{4, 5}));
  EXPECT_EQ(Parse(OneTensor(6, 0, {2, 1, 3}, {3, 9, 1})).at("w").shape,
            (std::vector<int64_t>{2, 1, 3}));
}

TEST(TorchArchiveTest, ReadsTensorsThatShareStorage) {
  PickleWriter pickle;
  pickle.Op('}').Text("tied").Tensor("FloatStorage", "0", 6, 0, {6}, {1}).Raw("q\x01s");
  pickle.Text("tied2").Raw("h\x01s").Text("part");
  pickle.Tensor("FloatStorage", "0", 6, 4, {2}, {1}).Op('s').Text("epoch").Int(3).Op('s');
  const WeightMap read = Parse(Archive(pickle.Finish()));
  EXPECT_EQ(read.size(), 3u);
  EXPECT_EQ(read.at("tied").values, read.at("tied2").values);
  EXPECT_EQ(read.at("part").values, (std::vector<float>{4, 5}));
}

TEST(TorchArchiveTest, RunsNoCode) {
  // os.system("true"), and the same with the other instruction that names a class.
  PickleWriter direct;
  direct.Global("os", "system").Text("true").Op('\x85').Op('R');
  EXPECT_THAT(RefusalOf(Archive(direct.Finish())), HasSubstr("\"os.system\""));
  PickleWriter stacked;
  stacked.Text("builtins").Text("eval").Op('\x93');
  EXPECT_THAT(RefusalOf(Archive(stacked.Finish())), HasSubstr("\"builtins.eval\""));
  PickleWriter model;
  model.Global("__main__", "Net\x1b[31m").Op(')').Op('\x81');
  EXPECT_THAT(RefusalOf(Archive(model.Finish())), HasSubstr("\"__main__.Net?[31m\""));
  PickleWriter script;  // a TorchScript class outside TorchScript
  script.Global("__torch__", "Net").Op(')').Op('\x81');
  EXPECT_THAT(RefusalOf(Archive(script.Finish())), HasSubstr("state dict"));
}

TEST(TorchArchiveTest, RefusesTensorsBeyondTheirStorage) {
  constexpr int64_t kHuge = int64_t{1} << 62;
  EXPECT_THAT(RefusalOf(OneTensor(7, 0, {7}, {1})), HasSubstr("beyond the 6 elements"));
  EXPECT_THAT(RefusalOf(OneTensor(6, 1, {6}, {1})), HasSubstr("beyond"));
  EXPECT_THAT(RefusalOf(OneTensor(6, kHuge, {1}, {1})), HasSubstr("beyond"));
  EXPECT_THAT(RefusalOf(OneTensor(6, 0, {2, 2}, {kHuge, kHuge})), HasSubstr("beyond"));
  EXPECT_THAT(RefusalOf(OneTensor(6, 0, {kHuge, kHuge}, {0, 0})), HasSubstr("counted"));
  EXPECT_THAT(RefusalOf(OneTensor(6, 0, {int64_t{1} << 59}, {0})), HasSubstr("8 times"));
  EXPECT_THAT(RefusalOf(OneTensor(6, 0, {2, 3}, {1})), HasSubstr("strides do not fit"));
  EXPECT_THAT(RefusalOf(OneTensor(6, 0, {-1}, {1})), HasSubstr("negative"));
  EXPECT_THAT(RefusalOf(OneTensor(6, 0, {2}, {-1})), HasSubstr("negative"));
  EXPECT_THAT(RefusalOf(OneTensor(-6, 0, {2}, {1})), HasSubstr("unknown type or size"));
  EXPECT_THAT(RefusalOf(OneTensor(6, 0, std::vector<int64_t>(17, 1), {})), HasSubstr("16 dim"));
  EXPECT_THAT(RefusalOf(OneTensor(6, 0, {2}, {1}, "../../etc/passwd")), HasSubstr("missing"));
}

// 1000 views of one storage would take 1000 times the file.
TEST(TorchArchiveTest, BoundsMemoryOfViews) {
  PickleWriter pickle;
  pickle.Op('}').Op('(');
  for (int i = 0; i < 1000; ++i) {
    pickle.Text(std::to_string(i)).Tensor("FloatStorage", "0", 100000, 0, {100000}, {1});
  }
  EXPECT_THAT(RefusalOf(Archive(pickle.Op('u').Finish(), 100000)), HasSubstr("8 times"));
}

TEST(TorchArchiveTest, RefusesBrokenPickles) {
  const auto refusal = [](const std::string& body) {
    return RefusalOf(Archive("\x80\x02" + body));
  };
  EXPECT_THAT(refusal(""), HasSubstr("ends in the middle"));
  EXPECT_THAT(refusal("."), HasSubstr("takes more values"));
  EXPECT_THAT(refusal("h\x07."), HasSubstr("recalls a value that it never stored"));
  EXPECT_THAT(refusal("q\x01."), HasSubstr("takes more values"));
  EXPECT_THAT(refusal("K\x01(\x85."), HasSubstr("takes more values"));  // below the mark
  EXPECT_THAT(refusal("t."), HasSubstr("no mark"));
  EXPECT_THAT(refusal("(K\x01u."), HasSubstr("takes more values"));
  EXPECT_THAT(refusal("}(K\x01u."), HasSubstr("key without a value"));
  EXPECT_THAT(refusal("K\x01K\x01K\x01s."), HasSubstr("no dict"));
  EXPECT_THAT(refusal("K\x01K\x01R."), HasSubstr("no callable"));
  EXPECT_THAT(refusal("K\x01K\x01"
                      "b."),
              HasSubstr("takes none"));
  EXPECT_THAT(refusal("K\x01Q."), HasSubstr("no storage id"));
  EXPECT_THAT(refusal("P0\n."), HasSubstr("the instruction 80"));
  EXPECT_THAT(refusal("X\xff\xff\xff\xff"
                      "a."),
              HasSubstr("middle of an instruction"));
  EXPECT_THAT(refusal("\x8a\x09"
                      "123456789."),
              HasSubstr("64 bits"));
  EXPECT_THAT(refusal("ctorch\nFloatStorage\n)R."), HasSubstr("calls a storage type"));
  EXPECT_THAT(refusal("K\x01."), HasSubstr("does not hold a state dict"));
  EXPECT_THAT(refusal("}."), HasSubstr("no tensors"));
  EXPECT_THAT(RefusalOf(Archive("\x80\x09}.")), HasSubstr("later protocol"));
}

TEST(TorchArchiveTest, EndsQuicklyForDeepAndCyclicPickles) {
  const std::string start = "\x80\x02";
  EXPECT_THAT(RefusalOf(Archive(start + ")" + std::string(400000, '\x85') + ".")),
              HasSubstr("does not hold"));
  EXPECT_THAT(RefusalOf(Archive(start + ")" + std::string(600000, '\x85') + ".")),
              HasSubstr("more than 500000 values"));
  EXPECT_THAT(RefusalOf(Archive(start + std::string(1000000, '('))), HasSubstr("ends in"));
  // A dict that is its own "params".
  EXPECT_THAT(RefusalOf(Archive(start + "}q\x01X\x06" + std::string(3, '\0') + "paramsh\x01s.")),
              HasSubstr("no tensors"));
}

// Modules that contain each other, and a chain of 60 modules that each contain the next twice (2^60
// paths).
TEST(TorchArchiveTest, RefusesCyclicAndDoublingModules) {
  const auto script = [](const std::string& pickle) {
    return RefusalOf(
        MakeZip({{"m/data.pkl", pickle}, {"m/code/x.py", ""}, {"m/constants.pkl", ""}}));
  };
  PickleWriter cycle;
  cycle.Global("__torch__", "M").Op(')').Op('\x81').Raw("q\x01").Op('}').Text("m").Raw("h\x01s");
  EXPECT_THAT(script(cycle.Op('b').Finish()), HasSubstr("nested too deeply"));
  PickleWriter chain;
  chain.Global("__torch__", "M").Raw(")\x81q").Op('\0');
  for (char i = 1; i < 60; ++i) {
    chain.Global("__torch__", "M").Raw(")\x81}");
    for (const char* name : {"a", "b"}) {
      chain.Text(name).Op('h').Op(static_cast<char>(i - 1)).Op('s');
    }
    chain.Op('b').Op('q').Op(i);
  }
  EXPECT_THAT(script(chain.Finish()), HasSubstr("too many attributes"));
}

TEST(ZipArchiveTest, RefusesHostileArchives) {
  const std::string pickle = PickleWriter().Op('}').Finish();
  EXPECT_THAT(RefusalOf(MakeZip({{"m/data.pkl", pickle}, {"../evil", "x"}})),
              HasSubstr("\"../evil\" is not a plain relative path"));
  EXPECT_THAT(RefusalOf(MakeZip({{"m/data.pkl", pickle}, {"/evil", "x"}})), HasSubstr("plain"));
  EXPECT_THAT(RefusalOf(MakeZip({{"m/data.pkl", pickle}, {"m/data.pkl", pickle}})),
              HasSubstr("twice"));
  EXPECT_THAT(RefusalOf(MakeZip({{"m/data.pkl", pickle, 8}})), HasSubstr("compressed"));
  EXPECT_THAT(RefusalOf(MakeZip({{"m/data.pkl", pickle}, {"n/data.pkl", pickle}})),
              HasSubstr("more than one data.pkl"));
  EXPECT_THAT(RefusalOf(MakeZip({{"m/readme", pickle}})), HasSubstr("without data.pkl"));
  EXPECT_THAT(RefusalOf(MakeZip({{"m/", ""}, {"m/data.pkl", pickle}})), HasSubstr("no tensors"));
  EXPECT_THAT(RefusalOf(MakeZip({{"m/data.pkl", pickle}, {"m/byteorder", "big"}})),
              HasSubstr("big-endian"));
}

// Two directory entries of different names for one range of the file.
TEST(ZipArchiveTest, RefusesOverlappingRecords) {
  std::string inner = MakeZip({{"m/data/1", "content"}});
  inner.resize(inner.find("PK\x01\x02"));
  const std::string pickle = PickleWriter().Op('}').Finish();
  std::string bytes = MakeZip({{"m/data.pkl", pickle}, {"m/data/0", inner}, {"m/data/1", "x"}});
  const size_t real = bytes.rfind("PK\x03\x04");
  const auto hidden = static_cast<uint32_t>(bytes.find("PK\x03\x04", bytes.find("m/data/0")));
  ASSERT_LT(hidden, real);
  bytes.replace(bytes.rfind("PK\x01\x02") + 42, 4, reinterpret_cast<const char*>(&hidden), 4);
  EXPECT_THAT(RefusalOf(bytes), HasSubstr("overlap"));
}

TEST(TorchArchiveTest, AFileCutAnywhereIsRefused) {
  const std::string bytes = MakeStateDict(SomeWeights(), {"params"});
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_NE(RefusalOf(bytes.substr(0, size)), "accepted") << size;
  }
}

TEST(TorchArchiveTest, ReadsOrRefusesAnyFlippedBit) {
  const std::string bytes = MakeStateDict(SomeWeights(), {"params"});
  for (size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    std::string damaged = bytes;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    RefusalOf(damaged);
  }
}

TEST(WeightFileTest, DistinguishesOtherKindsOfFiles) {
  EXPECT_THAT(RefusalOf(std::string("\x80\x02\x8a\x0al\xfc\x9c"
                                    "F\xf9 j\xa8P\x19.",
                                    15)),
              HasSubstr("before 1.6"));
  EXPECT_THAT(RefusalOf("\x89HDF\r\n\x1a\n plus more"), HasSubstr("not a weight file"));
  EXPECT_THAT(RefusalOf(""), HasSubstr("not a weight file"));
}

TEST(WeightFileTest, FourFormatsHaveTheSameValues) {
  const std::filesystem::path folder = std::filesystem::path(COLOR3D_SHARED_DATA) / "golden";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no shared data";
  const WeightMap expected = ReadWeightFile(folder / "ddcolor_mini.safetensors");
  EXPECT_GT(expected.size(), 100u);
  ExpectSame(ReadWeightFile(folder / "ddcolor_mini_params.pth"), expected, "params");
  ExpectSame(ReadWeightFile(folder / "ddcolor_mini_raw.bin"), expected, "raw");
  const WeightMap half = ReadWeightFile(folder / "ddcolor_mini_f16.safetensors");
  ASSERT_EQ(half.size(), expected.size());
  for (const auto& [name, array] : expected) {
    ASSERT_EQ(half.at(name).shape, array.shape);
    for (size_t i = 0; i < array.values.size(); ++i) {
      ASSERT_NEAR(
          half.at(name).values[i], array.values[i], std::abs(array.values[i]) / 2048.0f + 3e-8f)
          << name;
    }
  }
}

}  // namespace
}  // namespace color3d
