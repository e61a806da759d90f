// Flags for the source of the key view's colour, shared by all commands that colour a key view.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client/lib/connection.h"
#include "color3d/v1/stage.pb.h"

namespace color3d::client {

struct KeyColorFlags {
  std::string image;   // the key view, coloured
  std::string hints;   // strokes, or points as .json; besides a source points above its colours
  std::string labels;  // label picture of the points
  std::string edit;    // the key view in colour, edited
  std::string mask;    // for edit and backend
  std::string prompt;  // a source, or input of the backend
  std::vector<std::string> references;
  bool automatic = false;
  std::string backend;  // name on the server
  std::string script;
  std::string model;

  // Returns whether a source is given.
  bool HasSource() const;
  // Returns the file of a source that is drawn for a certain view, whose name may give the view;
  // empty for other sources.
  std::string PictureOfView() const;
  // Checks that need no server. Throws Error{kInvalidArgument} if flags exclude each other, and the
  // errors of reading the files.
  void Check() const;
};

void DeclareKeyColorFlags(CLI::App& app, KeyColorFlags* flags);

// Uploads missing files and returns the source. Requires: flags.Check() has passed.
v1::KeyColorSource UploadKeyColor(Connection& connection, const KeyColorFlags& flags);

}  // namespace color3d::client
