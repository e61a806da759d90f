// The stack machine that a pickle's instructions are written for: what each of them does to the
// values. For this folder only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/weights/pickle.h"
#include "core/weights/pickle_bytes.h"

namespace color3d {

// Every function throws Error{kInvalidArgument} when the values that it takes are not there or are
// of another kind. Values are named by their index in the graph.
class PickleMachine {
 public:
  // `bytes` must outlive the machine; it only tells messages where the pickle is damaged.
  PickleMachine(const PickleBytes& bytes, bool allow_objects)
      : bytes_(bytes), allow_objects_(allow_objects) {}

  void Push(PickleValue::Kind kind, int64_t number = 0, std::string_view text = {});
  void PushItems(PickleValue::Kind kind, std::vector<uint32_t> items);
  void PushGlobal(std::string_view module, std::string_view name);
  // Takes a module's and a class's name.
  void PushGlobalOfNames();
  // Takes the tuple that names a storage.
  void PushStorage();

  std::vector<uint32_t> PopLast(size_t count);
  std::vector<uint32_t> PopToMark();
  void Mark() { marks_.push_back(stack_.size()); }

  void Remember(uint32_t slot);
  void RememberNext() { Remember(static_cast<uint32_t>(memo_.size())); }
  void Recall(uint32_t slot);

  // To the list or dict on top of the stack.
  void Append(const std::vector<uint32_t>& items);
  void SetItems(const std::vector<uint32_t>& items);  // key, value, key, value ...
  // Takes an argument tuple and a callable and pushes what the call makes.
  void Call();
  // Takes a state and gives it to the value below it.
  void Build();

  // The value on top is the result. The machine is used up.
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
