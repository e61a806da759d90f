#include "client/commands/open_browser.h"

#include <sys/wait.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "client/lib/detached_program.h"

namespace color3d::client {
namespace {

// Starts `program` on a page. It may become the browser, so it must outlive this process. Returns
// false if it is missing or fails within two seconds.
bool StartOnPage(const char* program, const std::string& page) {
  pid_t child = 0;
  if (StartDetached({program, page}, "/dev/null", &child) != 0) return false;
  for (int tenths = 0; tenths < 20; ++tenths) {
    int status = 0;
    if (waitpid(child, &status, WNOHANG) == child) {
      return WIFEXITED(status) && WEXITSTATUS(status) == 0;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return true;
}

}  // namespace

bool OpenInBrowser(const std::string& page) {
#if defined(__APPLE__)
  return StartOnPage("open", page);
#else
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return false;
  return StartOnPage("xdg-open", page);
#endif
}

}  // namespace color3d::client
