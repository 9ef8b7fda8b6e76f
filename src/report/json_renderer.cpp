#include "json_writer.hpp"
#include "renderers.hpp"

namespace spindle::report {
namespace {

class JsonRenderer final : public Renderer {
 public:
  JsonRenderer(Streams& streams, Verbosity verbosity) : streams_(streams), verbosity_(verbosity) {}

  Result<void> begin(std::span<const Column> /*columns*/) override { return {}; }

  Result<void> record(const Record& record) override {
    line_.clear();
    append_json(line_, record);
    line_ += '\n';
    return lines_.write(line_);
  }

  Result<void> end() override { return {}; }

  Result<void> line(const Record& record, std::string_view /*plain*/) override {
    return this->record(record);
  }

  void note(std::string_view sentence) override {
    say_sentence(streams_, verbosity_, Severity::notice, sentence);
  }

  Result<void> summary(const Record& counts, std::string_view /*sentence*/) override {
    return record(counts);
  }

  Result<void> error(const Error& error, WallTime time) override {
    Record told = error_record(error, time);
    if (std::string command = command_to_try(error, streams_.typed); !command.empty()) {
      told.fields.push_back({"try", std::move(command)});
    }
    if (!error.details.empty()) told.fields.push_back({"details", Texts(error.details)});
    Result<void> written = record(told);
    say_error(streams_, error);
    return written;
  }

 private:
  Streams& streams_;
  Verbosity verbosity_;
  std::string line_;
  LineWriter lines_{streams_, "\n"};
};

}  // namespace

std::unique_ptr<Renderer> make_json_renderer(Streams& streams, Verbosity verbosity) {
  return std::make_unique<JsonRenderer>(streams, verbosity);
}

}  // namespace spindle::report
