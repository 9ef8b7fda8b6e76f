#include "spindle/commands/stored_rows.hpp"

#include <utility>

#include "stored_records.hpp"

namespace spindle::commands {
namespace {

class OpenRows final : public StoredRows {
 public:
  explicit OpenRows(std::unique_ptr<store::Reader> reader, Context& context)
      : reader_(std::move(reader)), shelf_(context.profiles) {}

  Result<void> read(Context& context) {
    TRY_LET(records_, StoredRecords::make(*reader_, shelf_, context));
    return {};
  }

  store::Reader& reader() override { return *reader_; }
  Result<void> refresh() override {
    TRY(records_->refresh(*reader_));
    return {};
  }
  report::Record event(const store::EventView& row) override { return records_->event(row); }
  report::Record gap(const store::Gap& row) override { return records_->gap(row); }
  report::Record happening(const store::Happening& row) override {
    return records_->happening(row);
  }
  [[nodiscard]] const store::Tool* tool(store::RowId id) const override {
    return records_->tool(id);
  }
  [[nodiscard]] const store::Place* place(store::RowId id) const override {
    return records_->place(id);
  }
  [[nodiscard]] const store::Place* place_at(store::RowId tool, WallTime time) const override {
    return records_->place_at(tool, time);
  }

 private:
  std::unique_ptr<store::Reader> reader_;
  ProfileShelf shelf_;
  std::optional<StoredRecords> records_ = std::nullopt;
};

}  // namespace

Result<std::unique_ptr<StoredRows>> StoredRows::open(const std::string& path, Context& context) {
  TRY_LET(auto reader, store::Reader::open(path));
  auto rows = std::make_unique<OpenRows>(std::move(reader), context);
  TRY(rows->read(context));
  return rows;
}

}  // namespace spindle::commands
