// Stack machine of a pickle: the effect of each instruction on the values. For this folder only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/weights/pickle.h"
#include "core/weights/pickle_bytes.h"

namespace color3d {

// All functions throw Error{kInvalidArgument} if the values that they pop are missing or of another
// kind. Values are identified by their index in the graph.
class PickleMachine {
 public:
  // `bytes` must outlive the machine. It gives the position in messages.
  PickleMachine(const PickleBytes& bytes, bool allow_objects)
      : bytes_(bytes), allow_objects_(allow_objects) {}

  void Push(PickleValue::Kind kind, int64_t number = 0, std::string_view text = {});
  void PushItems(PickleValue::Kind kind, std::vector<uint32_t> items);
  void PushGlobal(std::string_view module, std::string_view name);
  // Pops the names of a module and a class.
  void PushGlobalOfNames();
  // Pops the tuple that describes a storage.
  void PushStorage();

  std::vector<uint32_t> PopLast(size_t count);
  std::vector<uint32_t> PopToMark();
  void Mark() { marks_.push_back(stack_.size()); }

  void Remember(uint32_t slot);
  void RememberNext() { Remember(static_cast<uint32_t>(memo_.size())); }
  void Recall(uint32_t slot);

  // Adds to the list or dict on top of the stack.
  void Append(const std::vector<uint32_t>& items);
  void SetItems(const std::vector<uint32_t>& items);  // key, value, key, value ...
  // Pops a tuple of arguments and a callable, and pushes the result of the call.
  void Call();
  // Pops a state and sets it on the value below.
  void Build();

  // Returns the value on top as the result. The machine must not be used afterwards.
  PickleGraph Finish();

 private:
  uint32_t Add(PickleValue value);
  void RequireAboveMark(size_t count) const;
  uint32_t Pop();
  uint32_t Top() const;
  const PickleValue& Expect(uint32_t index, PickleValue::Kind kind, const char* what) const;
  std::vector<uint32_t> FirstItems(uint32_t index, size_t count, const char* what) const;
  std::vector<int64_t> Sizes(uint32_t index) const;
  void PushTensor(const std::vector<uint32_t>& arguments);

  const PickleBytes& bytes_;
  const bool allow_objects_;
  PickleGraph graph_;
  std::vector<uint32_t> stack_;
  std::vector<size_t> marks_;
  std::unordered_map<uint32_t, uint32_t> memo_;
};

}  // namespace color3d
