// Runs exported models in headless Chromium with onnxruntime-web: node onnx_page.mjs FOLDER NAME...
// FOLDER has the program of the guide (gestures.mjs) and samples.f32; each folder NAME in it has an exported model.
// Prints {NAME: joints as base64 of float32}. Models with a third file, model.joints.onnx, are run segment by segment.

import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join } from "node:path";
import { launch } from "../study/browser/page.mjs";

const [folder, ...names] = process.argv.slice(2);
const runtime = join(process.env.ORATOR_WEB, "node_modules/onnxruntime-web/dist");
const imports = { "onnxruntime-web": "/runtime/ort.wasm.min.mjs" };
const page = (name) => `<base href="/${name}/"><script type="importmap">${JSON.stringify({ imports })}</script>`;
const types = { ".mjs": "text/javascript", ".wasm": "application/wasm" };

const server = createServer((request, response) => {
  const path = request.url.slice(1);
  try {
    const [first, ...rest] = path.split("/");
    const isPage = rest.length === 1 && rest[0] === "";
    const file = first === "runtime" ? join(runtime, ...rest) : join(folder, path);
    const body = isPage ? page(first) : readFileSync(file);
    const type = isPage ? "text/html" : (types[extname(path)] ?? "application/octet-stream");
    response.writeHead(200, { "content-type": type });
    response.end(body);
  } catch {
    response.writeHead(404).end();
  }
});

async function run(isSequence) {
  const samples = new Float32Array(await (await fetch("/samples.f32")).arrayBuffer());
  const text = (joints) => {
    const bytes = new Uint8Array(joints.slice().buffer);
    return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  };
  if (!isSequence) {
    const { gestures } = await import("/gestures.mjs");
    return text(await gestures(samples));
  }
  const ort = await import("onnxruntime-web");
  const [frontEnd, model, decoder] = await Promise.all(
    ["model.mel.onnx", "model.onnx", "model.joints.onnx"].map((file) => ort.InferenceSession.create(file)),
  );
  const { cepstra, frames } = await frontEnd.run({ samples: new ort.Tensor("float32", samples, [1, samples.length]) });
  const [length, size] = [model.inputMetadata[0].shape[1], model.inputMetadata[1].shape];
  let previous = new ort.Tensor("float32", new Float32Array(size[1] * size[2]), size);
  const [n, poses] = [Number(frames.data[0]), []];
  for (let first = 0; first < n; first += model.outputMetadata[0].shape[1]) {
    const rows = cepstra.data.slice(26 * first, 26 * (first + length));
    const segment = await model.run({ cepstra: new ort.Tensor("float32", rows, [1, length, 26]), previous });
    poses.push(...segment.poses.data);
    previous = segment.next;
  }
  const all = new ort.Tensor("float32", Float32Array.from(poses.slice(0, n * size[2])), [n, size[2]]);
  return text((await decoder.run({ poses: all })).joints.data);
}

await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
const browser = await launch();
try {
  const results = {};
  for (const name of names) {
    const tab = await browser.newPage();
    tab.on("console", (message) => console.error(message.text()));
    await tab.goto(`http://127.0.0.1:${server.address().port}/${name}/`);
    results[name] = await tab.evaluate(run, name.startsWith("sequence"));
    await tab.close();
  }
  console.log(JSON.stringify(results));
} finally {
  await browser.close();
  server.close();
}
