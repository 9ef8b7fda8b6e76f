#pragma once

#include "spindle/commands/context.hpp"

namespace spindle::page {

/// A renderer that shows nothing: what a page has to say stands on the page, and several threads
/// read the store.
class SilentRenderer final : public report::Renderer {
 public:
  Result<void> begin(std::span<const report::Column> /*columns*/) override { return {}; }
  Result<void> record(const report::Record& /*record*/) override { return {}; }
  Result<void> end() override { return {}; }
  Result<void> line(const report::Record& /*record*/, std::string_view /*plain*/) override {
    return {};
  }
  void note(std::string_view /*sentence*/) override {}
  Result<void> summary(const report::Record& /*record*/, std::string_view /*sentence*/) override {
    return {};
  }
  Result<void> error(const Error& /*error*/, WallTime /*time*/) override { return {}; }
};

/// A context of one thread's own that tells nothing.
class QuietContext {
 public:
  explicit QuietContext(const commands::Context& context)
      : context_(commands::with_renderer(context, renderer_)) {}
  QuietContext(const QuietContext&) = delete;
  QuietContext& operator=(const QuietContext&) = delete;
  ~QuietContext() = default;

  [[nodiscard]] commands::Context& get() { return context_; }

 private:
  SilentRenderer renderer_ = {};
  commands::Context context_;
};

}  // namespace spindle::page
