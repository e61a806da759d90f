// Calls of the page that correct a scene, listed in client/studio/README.md.
#pragma once

#include <httplib.h>

#include <functional>
#include <string>

#include "client/studio/correct/corrections.h"

namespace color3d::client {

// How the studio answers calls; patterns as of httplib.
struct StudioRoutes {
  using Get = std::function<void(const httplib::Request&, httplib::Response&)>;
  using Post = std::function<void(
      const httplib::Request&, httplib::Response&, const httplib::ContentReader&)>;
  using Send = std::function<bool(const std::string&)>;
  std::function<void(const std::string& pattern, Get)> get;
  std::function<void(const std::string& pattern, Post)> post;
  // Answers with events. `watch` passes each state to `send` until that returns false.
  std::function<void(httplib::Response&, std::function<void(const Send& send)> watch)> stream;
};

// `corrections` must outlive the server.
void AddCorrectRoutes(Corrections& corrections, const StudioRoutes& routes);

}  // namespace color3d::client
