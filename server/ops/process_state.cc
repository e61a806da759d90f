#include "server/ops/process_state.h"

#include <fstream>
#include <string>

namespace color3d {

char ProcessState(pid_t pid) {
  std::ifstream stream("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(stream, line);
  // After the program's name, which is in parentheses and may contain some.
  const size_t name_end = line.rfind(')');
  return name_end != std::string::npos && name_end + 2 < line.size() ? line[name_end + 2] : '\0';
}

bool IsRunning(pid_t pid) {
  const char state = ProcessState(pid);
  return state != '\0' && state != 'Z' && state != 'X';
}

bool IsStopped(pid_t pid) {
  const char state = ProcessState(pid);
  return state == 'T' || state == 't';
}

}  // namespace color3d
