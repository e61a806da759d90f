// Where the key view's colour comes from, as flags: shared by all commands that colour it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client/lib/connection.h"
#include "color3d/v1/stage.pb.h"

namespace color3d::client {

struct KeyColorFlags {
  std::string image;   // the key view, coloured
  std::string hints;   // strokes, or points as .json
  std::string labels;  // picture that the points' labels refer to
  std::string edit;    // the key view in colour, edited
  std::string mask;    // of edit and backend
  std::string prompt;  // of its own, or for the backend
  std::vector<std::string> references;
  bool automatic = false;
  std::string backend;  // by name in the server's configuration
  std::string script;
  std::string model;

  // Any source at all.
  bool Given() const;
  // Drawn for one certain view, so that its file's name may tell which; empty: for any view.
  std::string FileOfView() const;
  // What can be said without the server. Throws Error{kInvalidArgument} when flags do not go
  // together, in one line, and what reading the files throws.
  void Check() const;
};

void DeclareKeyColorFlags(CLI::App& app, KeyColorFlags* flags);

// Sends the files that the server lacks and says what was given. `flags` has been checked.
v1::KeyColorSource UploadKeyColor(Connection& connection, const KeyColorFlags& flags);

}  // namespace color3d::client
