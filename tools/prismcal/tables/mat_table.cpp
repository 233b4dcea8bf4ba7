// SPDX-License-Identifier: MIT
// MATLAB's .mat files (libmatio) as a table: each real vector, matrix column and field of a struct is a column.
#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/outside_text.hpp"
#include "compensation/sample.hpp"
#include "tools/prismcal/tables/containers.hpp"

namespace prism::tables {
namespace {

constexpr std::size_t kMaxColumns = 1000;
constexpr int kMaxDepth = 8;

struct MatColumn {
  std::string name;
  std::vector<double> values;
};

template <class Number>
void append_numbers(const void* data, std::size_t first, std::size_t count, std::vector<double>& values) {
  const auto* const numbers = static_cast<const Number*>(data) + first;
  for (std::size_t i = 0; i < count; ++i) values.push_back(static_cast<double>(numbers[i]));
}

/// Appends `count` numbers of a variable; returns false for a type that is not numeric.
bool append(const matvar_t& variable, std::size_t first, std::size_t count, std::vector<double>& values) {
  switch (variable.data_type) {
    case MAT_T_DOUBLE:
      append_numbers<double>(variable.data, first, count, values);
      return true;
    case MAT_T_SINGLE:
      append_numbers<float>(variable.data, first, count, values);
      return true;
    case MAT_T_INT8:
      append_numbers<std::int8_t>(variable.data, first, count, values);
      return true;
    case MAT_T_UINT8:
      append_numbers<std::uint8_t>(variable.data, first, count, values);
      return true;
    case MAT_T_INT16:
      append_numbers<std::int16_t>(variable.data, first, count, values);
      return true;
    case MAT_T_UINT16:
      append_numbers<std::uint16_t>(variable.data, first, count, values);
      return true;
    case MAT_T_INT32:
      append_numbers<std::int32_t>(variable.data, first, count, values);
      return true;
    case MAT_T_UINT32:
      append_numbers<std::uint32_t>(variable.data, first, count, values);
      return true;
    case MAT_T_INT64:
      append_numbers<std::int64_t>(variable.data, first, count, values);
      return true;
    case MAT_T_UINT64:
      append_numbers<std::uint64_t>(variable.data, first, count, values);
      return true;
    default:
      return false;
  }
}

void add_matrix(const matvar_t& variable, const std::string& name, std::vector<MatColumn>& columns) {
  if (variable.rank != 2 || variable.isComplex != 0 || !variable.data) return;
  std::size_t rows = variable.dims[0], width = variable.dims[1];
  if (rows == 1) std::swap(rows, width);  // a row vector
  if (rows < 2 || width < 1 || width > kMaxColumns) return;
  if (variable.nbytes / std::max(1, variable.data_size) < rows * width) return;
  for (std::size_t c = 0; c < width && columns.size() < kMaxColumns; ++c) {
    MatColumn column{width == 1 ? name : fmt::format("{}({})", name, c + 1), {}};
    column.values.reserve(rows);
    if (append(variable, c * rows, rows, column.values)) columns.push_back(std::move(column));
  }
}

/// Adds a variable and its fields. `opaque`: names of objects that only MATLAB can read.
void add_variable(matvar_t& variable, const std::string& name, int depth, std::vector<MatColumn>& columns,
                  std::vector<std::string>& opaque) {
  if (depth > kMaxDepth || columns.size() >= kMaxColumns) return;
  if (variable.class_type == MAT_C_STRUCT) {
    const unsigned fields = Mat_VarGetNumberOfFields(&variable);
    char* const* const names = Mat_VarGetStructFieldnames(&variable);
    for (unsigned i = 0; names && i < fields; ++i) {
      matvar_t* const field = Mat_VarGetStructFieldByIndex(&variable, i, 0);
      if (field) add_variable(*field, name + "." + names[i], depth + 1, columns, opaque);
    }
  } else if (variable.class_type == MAT_C_OPAQUE || variable.class_type == MAT_C_OBJECT) {
    opaque.push_back(name);
  } else if (variable.class_type != MAT_C_CHAR && variable.class_type != MAT_C_CELL &&
             variable.class_type != MAT_C_SPARSE) {
    add_matrix(variable, name, columns);
  }
}

/// Keeps the columns of the most frequent length; of two equally frequent ones the longer.
void keep_one_length(std::vector<MatColumn>& columns) {
  std::map<std::size_t, std::size_t> counts;
  for (const MatColumn& column : columns) ++counts[column.values.size()];
  std::size_t length = 0, most = 0;
  for (const auto& [size, count] : counts) {
    if (count >= most) length = size, most = count;
  }
  std::erase_if(columns, [&](const MatColumn& column) { return column.values.size() != length; });
}

class MatTable : public TableSource {
 public:
  MatTable(const std::string& path, std::vector<MatColumn> data, TableOptions options)
      : TableSource(path), data_(std::move(data)), options_(std::move(options)) {
    for (const MatColumn& column : data_) columns_.push_back(read_header(column.name));
  }

  Result<void> select(Selection selection) override {
    selection_ = std::move(selection);
    counts_ = {};
    counts_.holes.assign(selection_.numbers.size(), 0);
    if (!selection_.time) return {};
    const std::size_t at = selection_.time->column;
    const auto& values = data_[at].values;
    const std::vector<double> sample(
        values.begin(), values.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(values.size(), 2000)));
    auto format = detect_number_time(path_, columns_[at], sample, selection_.time->unit, options_);
    if (!format) return tl::unexpected<Error>(format.error());
    time_ = std::move(*format);
    time_->scale = selection_.time->scale;
    time_->offset = selection_.time->offset;
    return {};
  }

  Result<bool> next(Block& block) override {
    block = Block{};
    const std::size_t end = std::min(at_ + kBlockRows, data_.front().values.size());
    block.rows = end - at_;
    for (std::size_t i = 0; i < selection_.numbers.size(); ++i) {
      const auto& values = data_[selection_.numbers[i]].values;
      block.columns.emplace_back(values.begin() + static_cast<std::ptrdiff_t>(at_),
                                 values.begin() + static_cast<std::ptrdiff_t>(end));
      for (double& value : block.columns.back()) {
        if (std::isfinite(value)) continue;
        value = kUnknown;
        ++counts_.holes[i];
      }
    }
    for (; at_ < end; ++at_) {
      block.lines.push_back(at_ + 1);
      if (selection_.keep_text) block.text.push_back(row_text());
      if (!time_) continue;
      const double value = data_[selection_.time->column].values[at_];
      if (!std::isfinite(value)) return make_error(fmt::format("{}, row {}", path_, at_ + 1), "found no time");
      const auto time_ns = time_->from_number(value, 0);
      if (!time_ns)
        return make_error(fmt::format("{}, row {}", path_, at_ + 1),
                          fmt::format("found time {:g}, expected one within 285 years of 1970", value));
      block.time_ns.push_back(*time_ns);
    }
    counts_.rows += block.rows;
    return block.rows > 0;
  }

  std::string dialect_text() const override { return "MATLAB file"; }
  ColumnKind kind(std::size_t) const override { return ColumnKind::kNumber; }

 private:
  std::string row_text() const {
    std::string text;
    for (const MatColumn& column : data_) text += fmt::format("{}{}", text.empty() ? "" : ",", column.values[at_]);
    return text;
  }

  std::vector<MatColumn> data_;
  TableOptions options_;
  std::size_t at_ = 0;
};

}  // namespace

Result<std::unique_ptr<TableSource>> open_mat(const std::string& path, const TableOptions& options) {
  const std::unique_ptr<mat_t, int (*)(mat_t*)> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY), &Mat_Close);
  if (!file) return make_error(path, "is a damaged MATLAB file");
  std::vector<MatColumn> columns;
  std::vector<std::string> opaque;
  while (true) {
    const std::unique_ptr<matvar_t, void (*)(matvar_t*)> variable(Mat_VarReadNext(file.get()), &Mat_VarFree);
    if (!variable) break;
    if (!variable->name) continue;
    if (auto good = check_text(TextRule::kText, variable->name, path); !good)
      return tl::unexpected<Error>(good.error());
    add_variable(*variable, variable->name, 0, columns, opaque);
  }
  keep_one_length(columns);
  if (columns.empty() && !opaque.empty())
    return make_error(path,
                      fmt::format("found only objects of MATLAB's classes ({}), which other programs cannot read; "
                                  "in MATLAB: save the numbers, as time = ts.Time; rate = ts.Data; or a table by "
                                  "writetable",
                                  fmt::join(opaque, ", ")));
  if (columns.empty()) return make_error(path, "found no vector or matrix of numbers");
  return std::unique_ptr<TableSource>(std::make_unique<MatTable>(path, std::move(columns), options));
}

}  // namespace prism::tables
