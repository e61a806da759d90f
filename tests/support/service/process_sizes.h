// Memory, descriptors and threads of processes, from /proc.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace color3d::testing {

struct ProcessSizes {
  double resident_mib = 0.0, peak_mib = 0.0, descriptors = 0.0, threads = 0.0;
};

// Sum over `pids`; ended processes count as 0.
inline ProcessSizes SizesOf(const std::vector<pid_t>& pids) {
  ProcessSizes sum;
  for (const pid_t pid : pids) {
    const std::filesystem::path folder = "/proc/" + std::to_string(pid);
    std::ifstream status(folder / "status");
    for (std::string line; std::getline(status, line);) {
      std::stringstream words(line);
      std::string name;
      double value = 0.0;
      words >> name >> value;
      if (name == "VmRSS:") sum.resident_mib += value / 1024.0;
      if (name == "VmHWM:") sum.peak_mib += value / 1024.0;
      if (name == "Threads:") sum.threads += value;
    }
    std::error_code none;
    const std::filesystem::directory_iterator descriptors(folder / "fd", none);
    sum.descriptors += static_cast<double>(std::distance(begin(descriptors), end(descriptors)));
  }
  return sum;
}

}  // namespace color3d::testing
