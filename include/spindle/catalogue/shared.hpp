#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <utility>

namespace spindle::catalogue {

/// A constant that several share, or none: as std::shared_ptr<const T>, but one that is a constant
/// itself as long as it holds nothing. A table of those needs neither a start nor an end.
template <typename T>
class Shared {
 public:
  constexpr Shared() = default;
  explicit Shared(T made) : block_(std::make_unique<Block>(std::move(made)).release()) {}

  constexpr Shared(const Shared& other) noexcept : block_(other.block_) {
    if (block_ != nullptr) block_->users.fetch_add(1, std::memory_order_relaxed);
  }
  constexpr Shared(Shared&& other) noexcept : block_(std::exchange(other.block_, nullptr)) {}
  constexpr Shared& operator=(Shared other) noexcept {
    std::swap(block_, other.block_);
    return *this;
  }
  constexpr ~Shared() {
    if (block_ != nullptr) release();
  }

  /// Requires that it holds something.
  [[nodiscard]] const T& get() const { return block_->made; }

 private:
  struct Block {
    explicit Block(T value) : made(std::move(value)) {}
    const T made;
    std::atomic<std::size_t> users{1};
  };

  void release() noexcept {
    if (block_->users.fetch_sub(1, std::memory_order_acq_rel) == 1) {
      const std::unique_ptr<Block> last(block_);
    }
  }

  Block* block_ = nullptr;
};

}  // namespace spindle::catalogue
