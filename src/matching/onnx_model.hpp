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

/// An ONNX model with fixed shapes, ready to run again and again: inputs are written into and
/// outputs read from memory that is bound once. The only place that knows ONNX Runtime.
class OnnxModel {
 public:
  /// `execution_provider`: "cpu" or "cuda". Throws std::runtime_error that names the file where it
  /// is missing, damaged, or has shapes that are not fixed, and where the provider is not there.
  OnnxModel(const std::filesystem::path& path, int threads, const std::string& execution_provider);

  /// Memory of a tensor. Throws std::runtime_error unless the model has an input (output) of this
  /// name, type and shape: call once and keep the span, which lives as long as the model.
  std::span<float> input(const std::string& name, const std::vector<std::int64_t>& shape);
  template <typename T>
  std::span<const T> output(const std::string& name, const std::vector<std::int64_t>& shape);

  /// Computes the outputs from the inputs. Throws std::runtime_error that names the file.
  void run();

  /// XXH3-64 of the file.
  [[nodiscard]] std::uint64_t fingerprint() const { return fingerprint_; }

 private:
  struct Tensor {
    std::string name;
    ONNXTensorElementDataType type = ONNX_TENSOR_ELEMENT_DATA_TYPE_UNDEFINED;
    std::vector<std::int64_t> shape;
    Ort::Value value{nullptr};
  };
  [[nodiscard]] std::vector<Tensor> allocate(bool inputs) const;
  [[nodiscard]] Tensor& find(std::vector<Tensor>& tensors, const char* kind,
                             const std::string& name, ONNXTensorElementDataType type,
                             const std::vector<std::int64_t>& shape) const;

  std::filesystem::path path_;
  std::uint64_t fingerprint_ = 0;
  Ort::Session session_{nullptr};
  std::vector<Tensor> inputs_;
  std::vector<Tensor> outputs_;
  Ort::IoBinding binding_{nullptr};
};

}  // namespace topoloc::matching
