// `color3d studio`: a page on loopback in which photos are coloured, and the calls that it makes
// (README.md). The work is done by the service; the studio keeps dropped files and hands on calls.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "client/lib/connection.h"
#include "client/studio/http_server.h"

namespace color3d::client {

struct StudioOptions {
  ServerTarget server;
  std::filesystem::path folder;  // dropped files
  int port = 0;                  // 0: any free port
  HttpLimits http;
  // The studio ends after this time without a request; 0: never. Jobs go on.
  std::chrono::seconds idle_exit{0};
  int64_t max_file_bytes = int64_t{8} << 30;  // of a dropped file
};

class Studio {
 public:
  // Listens on 127.0.0.1. `cancel` ends Serve. Throws Error{kFailedPrecondition} if the port is in
  // use.
  Studio(const StudioOptions& options, const CancellationToken& cancel);
  ~Studio();
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;

  // Offers a folder of photos, a film or a splat of the user's. Returns the name of its page.
  std::string OfferPhotos(const std::filesystem::path& path);
  // Returns the name of the page of a job ("jobs/...").
  static std::string PageOfJob(const std::string& job);

  // http://127.0.0.1:PORT/open?token=..., for one browser. `page`: the page that it shows.
  std::string Address(const std::string& page) const;
  int port() const;

  // Answers requests until `cancel` is set or nobody has used it for idle_exit. Calls `look` ten
  // times a second; `entered`: the address has let a browser in.
  void Serve(const std::function<void(bool entered)>& look = {});

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace color3d::client
