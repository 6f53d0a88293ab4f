"""Networks by their cards: any segmenter, depth or stereo network in ONNX; the only importer of onnxruntime."""
