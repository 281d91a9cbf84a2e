// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <onnxruntime_cxx_api.h>

namespace topoloc::matching {

/// An ONNX model, ready to run again and again: inputs are written into and outputs read from
/// memory that is bound once. The only place that knows ONNX Runtime.
class OnnxModel {
 public:
  using Shape = std::vector<std::int64_t>;
  static constexpr std::int64_t kAnySide = -1;  ///< a side that the file leaves open

  /// `execution_provider`: "cpu" or "cuda". Throws std::runtime_error that names the file where it
  /// is missing or damaged, and where the provider is not there.
  OnnxModel(const std::filesystem::path& path, int threads, const std::string& execution_provider);

  [[nodiscard]] bool has_input(const std::string& name) const;
  /// As the file states it. Throws std::runtime_error unless there is one with so many sides.
  [[nodiscard]] const Shape& input_shape(const std::string& name, std::size_t sides) const;
  /// Second side of a matrix. Throws std::runtime_error unless there is one and the side is fixed.
  [[nodiscard]] int input_columns(const std::string& name) const;
  [[nodiscard]] int output_columns(const std::string& name) const;

  /// Memory of a tensor. Throws std::runtime_error unless the model has an input (output) of this
  /// name, type and shape: call once and keep the span, which lives as long as the model. Sides of
  /// an input that the file leaves open become those of `shape`.
  std::span<float> input(const std::string& name, const Shape& shape);
  template <typename T>
  std::span<const T> output(const std::string& name, const Shape& shape);
  /// An output that may have another size in every run, along the sides that are kAnySide in
  /// `shape`. Throws as output() does; read it with result().
  void expect_output(const std::string& name, const Shape& shape);
  /// Throws std::runtime_error where the model has an input that nobody asked for: to be called
  /// once, after all others above.
  void require_no_other_inputs() const;

  /// Computes the outputs from the inputs. Throws std::runtime_error that names the file.
  void run();
  /// Of the last run, until the next; of an output that expect_output() announced.
  [[nodiscard]] std::span<const float> result(const std::string& name) const;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// XXH3-64 of the file.
  [[nodiscard]] std::uint64_t fingerprint() const { return fingerprint_; }

 private:
  struct Tensor {
    std::string name;
    ONNXTensorElementDataType type = ONNX_TENSOR_ELEMENT_DATA_TYPE_UNDEFINED;
    Shape shape;
    Ort::Value value{nullptr};  ///< null until asked for; of a variable output: of the last run
    bool variable = false;      ///< memory is ONNX Runtime's and new in every run
  };
  [[nodiscard]] std::vector<Tensor> describe(bool inputs) const;
  [[nodiscard]] std::size_t find(bool inputs, const std::string& name) const;
  [[nodiscard]] Tensor& expect(bool inputs, const std::string& name, ONNXTensorElementDataType type,
                               const Shape& shape);
  [[nodiscard]] const Tensor& with_sides(bool inputs, const std::string& name,
                                         std::size_t sides) const;
  [[nodiscard]] int columns(bool inputs, const std::string& name) const;
  [[noreturn]] void refuse(bool input, const Tensor& tensor, const std::string& expected) const;

  std::filesystem::path path_;
  std::uint64_t fingerprint_ = 0;
  Ort::Session session_{nullptr};
  std::vector<Tensor> inputs_;
  std::vector<Tensor> outputs_;
  Ort::IoBinding binding_{nullptr};
};

}  // namespace topoloc::matching
