#include "group_output.hpp"

#include <fmt/format.h>

namespace spindle::commands {

RecordedOutput::RecordedOutput(std::size_t tools, report::Renderer& renderer)
    : renderer_(&renderer) {
  for (std::size_t tool = 0; tool < tools; ++tool) {
    recordings_.push_back(std::make_unique<RecordingRenderer>());
  }
}

Result<void> RecordedOutput::end() {
  std::vector<const RecordingRenderer*> recordings;
  recordings.reserve(recordings_.size());
  for (const auto& recording : recordings_) recordings.push_back(recording.get());
  return replay(recordings, *renderer_);
}

template <typename Draw>
Result<void> SharedOutput::draw(Draw draw) {
  const std::lock_guard lock(mutex_);
  if (drawn_) drawn_ = draw(*renderer_);
  return drawn_;
}

/// What one tool says: its lists are part of the one list, and its summary is kept for the end.
class SharedOutput::Member final : public report::Renderer {
 public:
  explicit Member(SharedOutput& output) : output_(&output) {}
  Member(const Member&) = delete;
  Member& operator=(const Member&) = delete;
  ~Member() override = default;

  Result<void> begin(std::span<const report::Column> /*columns*/) override {
    return output_->draw([](report::Renderer&) { return Result<void>(); });
  }
  Result<void> record(const report::Record& record) override {
    return output_->draw([&](report::Renderer& renderer) { return renderer.record(record); });
  }
  Result<void> end() override { return {}; }
  Result<void> line(const report::Record& record, std::string_view plain) override {
    return output_->draw([&](report::Renderer& renderer) { return renderer.line(record, plain); });
  }
  void note(std::string_view sentence) override {
    static_cast<void>(output_->draw([&](report::Renderer& renderer) {
      renderer.note(sentence);
      return Result<void>();
    }));
  }
  Result<void> summary(const report::Record& record, std::string_view sentence) override {
    summary_ = RecordingRenderer::Line{record, std::string(sentence)};
    return {};
  }
  Result<void> error(const Error& error, WallTime time) override {
    return output_->draw([&](report::Renderer& renderer) { return renderer.error(error, time); });
  }

  [[nodiscard]] const std::optional<RecordingRenderer::Line>& kept_summary() const {
    return summary_;
  }

 private:
  SharedOutput* output_;
  std::optional<RecordingRenderer::Line> summary_ = std::nullopt;
};

SharedOutput::SharedOutput(std::size_t tools, std::span<const report::Column> columns,
                           report::Renderer& renderer)
    : renderer_(&renderer), drawn_(renderer.begin(columns)), members_() {
  for (std::size_t tool = 0; tool < tools; ++tool) {
    members_.push_back(std::make_unique<Member>(*this));
  }
}

SharedOutput::~SharedOutput() = default;

report::Renderer& SharedOutput::of_tool(std::size_t index) { return *members_.at(index); }

Result<void> SharedOutput::end() {
  if (drawn_) drawn_ = renderer_->end();
  for (const auto& member : members_) {
    const auto& summary = member->kept_summary();
    if (!drawn_ || !summary) continue;
    drawn_ = tell_under_name(*summary, *renderer_);
  }
  return drawn_;
}

}  // namespace spindle::commands
