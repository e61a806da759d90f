#include "server/rpc/scenes/transforms_outline.h"

#include <nlohmann/json.hpp>
#include <string>

#include "core/base/text/json_text.h"

namespace color3d {
namespace {

using nlohmann::json;

class Outliner : public nlohmann::json_sax<json> {
 public:
  bool null() override { return Value(); }
  bool boolean(bool) override { return Value(); }
  bool number_integer(number_integer_t) override { return Value(); }
  bool number_unsigned(number_unsigned_t) override { return Value(); }
  bool number_float(number_float_t, const string_t&) override { return Value(); }
  bool string(string_t&) override { return Value(); }
  bool binary(binary_t&) override { return Value(); }
  bool key(string_t& name) override {
    if (depth_ == 1) at_frames_ = name == "frames";
    return true;
  }
  bool start_object(std::size_t) override {
    if (depth_ == 0) outline_.is_object = true;
    return Open(false);
  }
  bool start_array(std::size_t) override { return Open(true); }
  bool end_object() override { return Close(); }
  bool end_array() override { return Close(); }
  bool parse_error(std::size_t,
                   const std::string&,
                   const nlohmann::detail::exception& error) override {
    error_ = JsonErrorText(error.what());
    return false;
  }
  const std::string& error() const { return error_; }
  const TransformsOutline& outline() const { return outline_; }

 private:
  bool Value() {
    if (depth_ == 1 && at_frames_) outline_.frames = 0;  // as readers do: the last one counts
    if (depth_ == 2 && in_frames_) ++outline_.frames;
    return true;
  }
  bool Open(bool is_array) {
    Value();
    if (depth_ == 1 && at_frames_) in_frames_ = is_array && outline_.is_object;
    ++depth_;
    return true;
  }
  bool Close() {
    --depth_;
    if (depth_ == 1) in_frames_ = false;
    return true;
  }

  TransformsOutline outline_;
  std::string error_;
  int depth_ = 0;
  bool at_frames_ = false;
  bool in_frames_ = false;
};

}  // namespace

TransformsOutline OutlineOfTransforms(std::string_view json_text) {
  Outliner outliner;
  if (json::sax_parse(PlainJson(json_text), PlainJson(), &outliner)) return outliner.outline();
  TransformsOutline none;
  none.error = outliner.error();
  return none;
}

}  // namespace color3d
