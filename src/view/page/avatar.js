// An avatar in 3D: a GLB with its animation, or a VRM avatar driven by a VRM animation. It is drawn only when something
// has changed.

import { AnimationMixer, Box3, DirectionalLight, GLTFLoader, GridHelper, HemisphereLight, LoopOnce, OrbitControls } from "./three.js";
import { PerspectiveCamera, Scene, Vector3, VRMAnimationLoaderPlugin, VRMLoaderPlugin, VRMLookAtQuaternionProxy } from "./three.js";
import { VRMUtils, WebGLRenderer, createVRMAnimationClip } from "./three.js";
import { el } from "./dom.js";

const TURN = Math.PI / 24;
const ZOOM = 0.9;
// Longest time step of swinging hair and clothes, in seconds.
const MAX_STEP = 0.1;

const loader = new GLTFLoader();
loader.register((parser) => new VRMLoaderPlugin(parser));
loader.register((parser) => new VRMAnimationLoaderPlugin(parser));

// Reads a GLB, VRM or VRMA file from an ArrayBuffer.
async function parse(bytes) {
  try {
    return await loader.parseAsync(bytes, "");
  } catch {
    throw new Error("This is not a GLB, VRM or VRMA file that the viewer can read.");
  }
}

export class AvatarView {
  #renderer = null;
  #scene = new Scene();
  #camera = new PerspectiveCamera(30, 1, 0.05, 50); #controls = null; #root = null; #vrm = null; #mixer = null; #action = null;
  #time = 0; #isWaiting = false; #isFramed = false;

  // `label` names the avatar for screen readers.
  constructor(label) {
    const help = "Arrow keys rotate, plus and minus zoom, 0 resets the camera.";
    this.canvas = el("canvas", { tabindex: "0", role: "application", "aria-label": `${label}. ${help}` });
    this.canvas.addEventListener("keydown", (event) => this.#key(event));
    this.message = el("p", { class: "over" });
    this.element = el("div", { class: "avatar" }, this.canvas, this.message);
    this.duration = 0;
  }

  // Shows a message over the avatar, or none for an empty text.
  say(text) {
    this.message.textContent = text;
    this.message.hidden = !text;
  }

  // Starts the renderer when it is first needed: a graphics context is expensive.
  #start() {
    if (this.#renderer) return true;
    try {
      this.#renderer = new WebGLRenderer({ canvas: this.canvas, alpha: true, antialias: true });
    } catch {
      this.say("This browser has no WebGL, which the avatar requires.");
      return false;
    }
    this.#scene.add(new HemisphereLight(0xffffff, 0x8d8a85, 2.4));
    const sun = new DirectionalLight(0xffffff, 1.8);
    sun.position.set(1.5, 3, 2.5);
    this.#scene.add(sun, new GridHelper(6, 12, 0x808890, 0x808890));
    this.#controls = new OrbitControls(this.#camera, this.canvas);
    this.#controls.addEventListener("change", () => this.#draw());
    // The wheel scrolls the page unless the avatar has the focus.
    this.canvas.addEventListener("focus", () => (this.#controls.enableZoom = true));
    this.canvas.addEventListener("blur", () => (this.#controls.enableZoom = false));
    this.#controls.enableZoom = false;
    this.sizes = new ResizeObserver(() => this.#resize());
    this.sizes.observe(this.element);
    return true;
  }

  // Shows a GLB or VRM file; `motion` is a VRMA file that drives a VRM avatar.
  async load(bytes, motion = null) {
    if (!this.#start()) return;
    const file = await parse(bytes);
    const vrm = file.userData.vrm ?? null;
    let [clip] = file.animations;
    if (motion) {
      if (!vrm) throw new Error("This is not a VRM avatar: its file has no extension VRMC_vrm or VRM.");
      const [animation] = (await parse(motion)).userData.vrmAnimations ?? [];
      if (!animation) throw new Error("This is not a VRM animation: its file has no extension VRMC_vrm_animation.");
      if (vrm.lookAt) {
        const proxy = new VRMLookAtQuaternionProxy(vrm.lookAt);
        proxy.name = "VRMLookAtQuaternionProxy";
        vrm.scene.add(proxy);
      }
      clip = createVRMAnimationClip(animation, vrm);
    }
    this.clear();
    if (vrm) VRMUtils.rotateVRM0(vrm);
    this.#vrm = vrm;
    this.#root = file.scene;
    // The bounds of a skinned mesh are those of its rest pose.
    this.#root.traverse((node) => (node.frustumCulled = false));
    this.#scene.add(this.#root);
    this.duration = clip?.duration ?? 0;
    if (clip) {
      this.#mixer = new AnimationMixer(this.#root);
      this.#action = this.#mixer.clipAction(clip).setLoop(LoopOnce).play();
      this.#action.clampWhenFinished = true;
    }
    this.time = 0;
    if (!this.#isFramed || motion) this.#frame();
    this.say("");
    this.#draw();
  }

  // Removes the avatar.
  clear() {
    if (this.#root) {
      this.#scene.remove(this.#root);
      VRMUtils.deepDispose(this.#root);
    }
    this.#root = this.#vrm = this.#mixer = this.#action = null;
    this.duration = 0;
    this.#draw();
  }

  // Time within the motion in seconds.
  set time(secs) {
    const step = secs - this.#time;
    this.#time = secs;
    if (this.#action) {
      this.#action.paused = false;
      this.#action.time = Math.min(Math.max(secs, 0), this.duration);
      this.#mixer.update(0);
    }
    this.#vrm?.update(step > 0 && step < MAX_STEP ? step : 0);
    this.#draw();
  }

  // Shows a pose of a VRM avatar: `rotations` by bone and position of the hips, which are at `height` in the rest pose.
  pose({ secs, hips, rotations }, height) {
    const humanoid = this.#vrm?.humanoid;
    if (!humanoid) return;
    // Avatars of VRM 0 face the other way.
    const turned = this.#vrm.meta.metaVersion === "0" ? -1 : 1;
    for (const [bone, [x, y, z, w]] of Object.entries(rotations)) {
      humanoid.getNormalizedBoneNode(bone)?.quaternion.set(turned * x, y, turned * z, w);
    }
    const root = humanoid.getNormalizedBoneNode("hips");
    const { position } = humanoid.normalizedRestPose.hips ?? {};
    if (root && position) {
      const scale = position[1] / height;
      root.position.set(position[0] + turned * scale * hips[0], scale * hips[1], position[2] + turned * scale * hips[2]);
    }
    this.time = secs;
  }

  // Releases the graphics memory; the view cannot be used again.
  close() {
    this.clear();
    this.sizes?.disconnect();
    this.#controls?.dispose();
    this.#renderer?.dispose();
    this.#renderer?.forceContextLoss();
    this.#renderer = null;
  }

  // Puts the camera in front of the upper body.
  #frame() {
    const box = new Box3().setFromObject(this.#root ?? this.#scene);
    const height = box.max.y - box.min.y || 1.7;
    const middle = box.getCenter(new Vector3());
    this.#controls.target.set(middle.x, box.min.y + 0.66 * height, middle.z);
    this.#camera.position.set(middle.x, box.min.y + 0.72 * height, middle.z + 1.75 * height);
    this.#controls.update();
    this.#isFramed = true;
  }

  #key(event) {
    const controls = this.#controls;
    if (!controls || event.ctrlKey || event.metaKey || event.altKey) return;
    const actions = {
      ArrowLeft: () => controls.rotateLeft(TURN), ArrowRight: () => controls.rotateLeft(-TURN),
      ArrowUp: () => controls.rotateUp(TURN), ArrowDown: () => controls.rotateUp(-TURN),
      "+": () => controls.dollyIn(ZOOM), "=": () => controls.dollyIn(ZOOM), "-": () => controls.dollyOut(ZOOM),
      0: () => this.#frame(),
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (!width || !height || !this.#renderer) return;
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.#draw();
  }

  #draw() {
    if (this.#isWaiting || !this.#renderer) return;
    this.#isWaiting = true;
    requestAnimationFrame(() => {
      this.#isWaiting = false;
      this.#renderer?.render(this.#scene, this.#camera);
    });
  }
}
