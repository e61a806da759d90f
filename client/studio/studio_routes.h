// What parts of the studio add their calls to. Exceptions of handlers become answers.
#pragma once

#include <functional>
#include <string>

#include "client/studio/http_library.h"

namespace color3d::client {

struct StudioRoutes {
  using Handler = std::function<void(const httplib::Request&, httplib::Response&)>;
  using BodyHandler = std::function<void(
      const httplib::Request&, httplib::Response&, const httplib::ContentReader&)>;

  using Send = std::function<bool(const std::string& state)>;

  std::function<void(const std::string& pattern, Handler)> get;
  std::function<void(const std::string& pattern, BodyHandler)> post;
  // Answers with events. `watch` passes each state to `send` until that returns false.
  std::function<void(httplib::Response&, std::function<void(const Send& send)> watch)> stream;
};

// "/api/BEFORE/IDAFTER", with ID as the first match.
inline std::string ApiPattern(const std::string& before, const std::string& after) {
  return "/api/" + before + "/([0-9a-f-]{1,64})" + after;
}

}  // namespace color3d::client
