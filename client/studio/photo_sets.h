// Photos or films that somebody brought to the studio: dropped files, kept in a folder each, or a
// folder that he named, left where it is. Outlives the studio. Thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/base/mutex.h"

namespace color3d::client {

struct PhotoSet {
  std::string id;
  std::string name;              // for the user
  std::filesystem::path folder;  // or one film
  std::string scene;             // "scenes/..." once uploaded to the service
  int64_t created_s = 0;         // seconds since 1970
  bool is_own = false;           // the studio's copy, which files may be added to
  bool as_frames = false;        // its pictures are frames of a film, in the order of their names
};

class PhotoSets {
 public:
  // `root` is created when the first set is.
  explicit PhotoSets(std::filesystem::path root) : root_(std::move(root)) {}

  PhotoSet Create(const std::string& name);
  // The set of a folder or film of the user's; the same path gives the same set.
  PhotoSet Adopt(const std::filesystem::path& path);
  // Throws Error{kNotFound}.
  PhotoSet Get(const std::string& id) const;
  // The newest first.
  std::vector<PhotoSet> List() const;
  void SetScene(const std::string& id, const std::string& scene);
  // Forgets the scene if this changes.
  void SetAsFrames(const std::string& id, bool as_frames);

  // Receives one file. `name`: a safe relative path, as browsers give for a dropped folder. `fill`
  // passes the bytes to the sink in pieces and returns false if they end early; then nothing is
  // kept. Returns the bytes. Throws Error: kInvalidArgument for other names, kFailedPrecondition
  // for a set of the user's own folder, kResourceExhausted if the disk is full.
  using Sink = std::function<bool(const char* bytes, size_t count)>;
  int64_t Receive(const std::string& id,
                  const std::string& name,
                  const std::function<bool(const Sink&)>& fill);

  // Keeps a picture of the user's, such as a coloured key view, and returns its file. `ending`:
  // ".png" and the like.
  std::filesystem::path KeepPicture(const std::string& id,
                                    const std::string& ending,
                                    const std::string& bytes);

  // Its file. Throws Error{kInvalidArgument} for other names, kNotFound.
  std::filesystem::path KeptPicture(const std::string& id, const std::string& name) const;

 private:
  void Write(const PhotoSet& set) const;

  const std::filesystem::path root_;
  Mutex mutex_;  // of changes
};

}  // namespace color3d::client
