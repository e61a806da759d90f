// Runs a fuzz target without libFuzzer on its seeds, all their prefixes, a corpus, and seeded
// mutations. All runs have the same inputs.
//   NAME_replay CORPUS [RUNS]   also uses the files of the folder; RUNS: number of mutations
//   NAME_replay FILE...         only these inputs
//   NAME_replay --write FOLDER  writes the seeds to the folder, for libFuzzer
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>

#include "core/base/files.h"
#include "core/base/random.h"
#include "tests/fuzz/fuzz_target.h"

namespace color3d {
namespace {

constexpr size_t kRuns = 50000;  // number of mutations; maximum number of prefixes

void RunOne(const std::string& input) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(input.data()), input.size());
}

// Numbers that break readers.
uint64_t StrangeNumber(Random& random) {
  constexpr uint64_t kStrange[] = {0,
                                   1,
                                   0x7f,
                                   0x80,
                                   0xff,
                                   0x7fff,
                                   0xffff,
                                   0x7fffffff,
                                   0x80000000,
                                   0xffffffff,
                                   uint64_t{1} << 60,
                                   ~uint64_t{0} >> 1,
                                   ~uint64_t{0}};
  return kStrange[random.NextBelow(std::size(kStrange))];
}

void Mutate(const std::vector<std::string>& seeds, Random& random, std::string& input) {
  const auto at = [&] { return random.NextBelow(static_cast<uint32_t>(input.size()) + 1); };
  const size_t place = at();
  switch (random.NextBelow(6)) {
    case 0:  // one bit
      if (place < input.size()) input[place] ^= static_cast<char>(1 << random.NextBelow(8));
      break;
    case 1:  // one byte
      if (place < input.size()) input[place] = static_cast<char>(random.NextBelow(256));
      break;
    case 2:  // cut a range
      input.erase(place, random.NextBelow(16));
      break;
    case 3: {  // repeat a range
      const std::string range = input.substr(at(), random.NextBelow(64));
      input.insert(place, range);
      break;
    }
    case 4: {  // a number of 1, 2, 4 or 8 bytes
      const uint64_t number = StrangeNumber(random);
      const size_t size = size_t{1} << random.NextBelow(4);
      if (place + size > input.size()) break;
      input.replace(place, size, reinterpret_cast<const char*>(&number), size);
      break;
    }
    default: {  // head of this input and tail of another
      const std::string& other = seeds[random.NextBelow(static_cast<uint32_t>(seeds.size()))];
      const size_t tail = random.NextBelow(static_cast<uint32_t>(other.size()) + 1);
      input = input.substr(0, place) + other.substr(tail);
      break;
    }
  }
}

void Replay(const std::vector<std::string>& seeds,
            const std::vector<std::string>& corpus,
            size_t runs) {
  size_t bytes = 0;
  for (const std::string& seed : seeds) bytes += seed.size();
  const size_t step = 1 + bytes / runs;
  for (const std::string& seed : seeds) {
    for (size_t size = 0; size < seed.size(); size += step) RunOne(seed.substr(0, size));
    RunOne(seed);
  }
  std::vector<std::string> all = seeds;
  for (const std::string& input : corpus) {
    RunOne(input);
    all.push_back(input);
  }
  Random random(/*seed=*/4);
  for (size_t i = 0; i < runs; ++i) {
    std::string input = all[random.NextBelow(static_cast<uint32_t>(all.size()))];
    const uint32_t count = 1 + random.NextBelow(4);
    for (uint32_t j = 0; j < count; ++j) Mutate(all, random, input);
    RunOne(input);
  }
}

int ReplayCorpus(const std::filesystem::path& folder, size_t runs) {
  std::vector<std::string> corpus;
  for (const std::string& file : ListFiles(folder)) corpus.push_back(ReadFile(folder / file));
  if (corpus.empty()) {
    std::fprintf(stderr, "%s has no inputs\n", folder.c_str());
    return 1;
  }
  Replay(FuzzSeeds(), corpus, runs);
  return 0;
}

void WriteSeeds(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const std::vector<std::string> seeds = FuzzSeeds();
  for (size_t i = 0; i < seeds.size(); ++i) {
    WriteFileAtomic(folder / fmt::format("seed{}", i), seeds[i]);
  }
}

}  // namespace
}  // namespace color3d

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() == 2 && arguments[0] == "--write") {
    color3d::WriteSeeds(arguments[1]);
    return 0;
  }
  if (!arguments.empty() && std::filesystem::is_directory(arguments[0])) {
    const size_t runs = arguments.size() > 1 ? std::stoul(arguments[1]) : color3d::kRuns;
    return color3d::ReplayCorpus(arguments[0], std::max<size_t>(1, runs));
  }
  if (arguments.empty()) {
    std::fprintf(stderr, "say a corpus, files, or --write FOLDER\n");
    return 2;
  }
  for (const std::string& file : arguments) color3d::RunOne(color3d::ReadFile(file));
  return 0;
}
