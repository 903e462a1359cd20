// The 3D view: a camera that is turned by hand, points whose colours change, whatever else is put into the scene, and what is under the pointer.
import * as THREE from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';

import {variable} from './colours.js';
import {quantile} from './layout.js';
import {evenly, Pace} from './pace.js';
import {Shading} from './shading.js';

const pointShader = {
  vertexShader: `
    attribute vec4 colour;
    uniform float size, scale, least, most;
    uniform bool perspective;
    varying vec3 shown;
    void main() {
      shown = colour.rgb;
      vec4 at = modelViewMatrix * vec4(position, 1.0);
      gl_Position = projectionMatrix * at;
      float wide = perspective ? size * scale / max(-at.z, 1e-6) : least;
      gl_PointSize = clamp(wide, least, most);
      if (colour.a < 0.5) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    }`,
  fragmentShader: `
    varying vec3 shown;
    void main() {
      vec2 off = gl_PointCoord - 0.5;
      if (dot(off, off) > 0.25) discard;
      gl_FragColor = vec4(shown, 1.0);
    }`,
};

export class View {
  /**
   * `start`: which way the camera stands from the scene's middle, a unit vector, and up, and what is to be seen whole beside the points:
   * {toward, up, balls: [{centre, radius}]}.
   */
  constructor(canvas, layout, start) {
    this.canvas = canvas;
    this.layout = layout;
    this.start = start;
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, powerPreference: 'high-performance'});
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;  // colours here are what the screen shows
    THREE.ColorManagement.enabled = false;
    this.scene = new THREE.Scene();
    this.pixelRatio = Math.min(window.devicePixelRatio || 1, 2);
    this.camera = layout.flat ? new THREE.OrthographicCamera() : new THREE.PerspectiveCamera(45);
    // The controls learn which way is up when they are made.
    this.camera.up.set(...(layout.flat ? [0, 1, 0] : start.up));
    this.controls = new OrbitControls(this.camera, canvas);
    this.shading = layout.flat ? undefined : new Shading(this.renderer, this.pixelRatio > 1.5 ? 0 : 4);
    this.afterRender = [];
    this.pace = new Pace(() => this.render());
    this.makePoints();
    this.setUpControls();
    this.home();
    this.controls.addEventListener('change', () => {
      this.pace.move();
      this.render();
    });
    this.controls.addEventListener('start', () => {
      this.atHome = false;
      this.pace.hold();
    });
    this.controls.addEventListener('end', () => this.pace.release());
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  makePoints() {
    const {positions, drawn, flat} = this.layout;
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    this.colours = new THREE.BufferAttribute(new Uint8Array(4 * drawn), 4, true);
    this.colours.setUsage(THREE.DynamicDrawUsage);
    this.geometry.setAttribute('colour', this.colours);
    this.geometry.setIndex(new THREE.BufferAttribute(evenly(drawn), 1));
    this.material = new THREE.ShaderMaterial({
      ...pointShader,
      transparent: true,  // so that they come after the hulls, which show where there are no points
      uniforms: {size: {value: this.spacing()}, scale: {value: 1}, least: {value: 1}, most: {value: 24}, perspective: {value: !flat}},
    });
    this.points = new THREE.Points(this.geometry, this.material);
    this.points.frustumCulled = false;
    this.points.renderOrder = 1;
    this.scene.add(this.points);
  }

  /** How far apart points are, roughly: they lie on surfaces. */
  spacing() {
    return (1.7 * this.layout.radius) / Math.sqrt(Math.max(this.layout.drawn, 1));
  }

  setUpControls() {
    this.controls.enableDamping = !matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.controls.dampingFactor = 0.12;
    this.controls.zoomToCursor = true;
    if (!this.layout.flat) return;
    this.controls.enableRotate = false;
    this.controls.screenSpacePanning = true;
    this.controls.mouseButtons = {LEFT: THREE.MOUSE.PAN, MIDDLE: THREE.MOUSE.DOLLY, RIGHT: THREE.MOUSE.PAN};
    this.controls.touches = {ONE: THREE.TOUCH.PAN, TWO: THREE.TOUCH.DOLLY_PAN};
  }

  /** Back to where the view began. */
  home() {
    const {radius, flat} = this.layout;
    this.camera.near = flat ? 0.1 * radius : 0.01 * radius;
    this.camera.far = 100 * radius;
    this.camera.zoom = 1;
    this.resize();
    this.goHome();
    this.controls.update();
    this.render();
  }

  /** The camera as near as it can be with all of the scene in sight, looking at the middle of what it sees. */
  goHome() {
    const {centre, radius, flat} = this.layout;
    this.atHome = true;
    this.controls.target.set(...centre);
    this.camera.position.set(centre[0], centre[1], 10 * radius);
    if (flat) return;
    const target = this.controls.target, toward = new THREE.Vector3(...this.start.toward);
    const right = new THREE.Vector3().crossVectors(this.camera.up, toward).normalize(), above = new THREE.Vector3().crossVectors(toward, right);
    const open = 0.94 * Math.tan((this.camera.fov * Math.PI) / 360), sides = [[right, open * this.camera.aspect], [above, open]];
    // A point is in sight where it is no further aside than the opening times its distance: each is a bound of distance and shift.
    // Of a thousand points one may be a stray.
    const fromTarget = (point) => new THREE.Vector3(...point).sub(target);
    const offs = this.layout.sample.map(fromTarget), balls = this.start.balls.map(({centre, radius}) => ({at: fromTarget(centre), radius}));
    const reach = sides.map(([axis, opening]) => [1, -1].map((sign) => {
      const bound = (at) => sign * at.dot(axis) + opening * at.dot(toward);
      const points = Float32Array.from(offs, bound).sort();
      return Math.max(quantile(points, 0.999), ...balls.map(({at, radius}) => bound(at) + radius * Math.hypot(1, opening)));
    }));
    const distance = Math.max(0.2 * radius, ...sides.map(([, opening], s) => (reach[s][0] + reach[s][1]) / (2 * opening)));
    sides.forEach(([axis], s) => target.addScaledVector(axis, (reach[s][0] - reach[s][1]) / 2));
    this.camera.position.copy(target).addScaledVector(toward, distance);
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    this.width = width;
    this.height = height;
    this.renderer.setPixelRatio(this.pixelRatio);
    this.renderer.setSize(width, height, false);
    this.shading?.resize(width * this.pixelRatio, height * this.pixelRatio);
    const aspect = width / height;
    if (this.layout.flat) {
      const [x, y] = [0, 1].map((d) => (this.layout.box.max[d] - this.layout.box.min[d]) / 2 || this.layout.radius);
      const half = 1.08 * Math.max(y, x / aspect);
      Object.assign(this.camera, {left: -half * aspect, right: half * aspect, top: half, bottom: -half});
      // Few points are larger.
      this.material.uniforms.least.value = Math.max(1.6, Math.min(5.5, 130 / Math.sqrt(this.layout.drawn))) * this.pixelRatio;
    } else {
      this.camera.aspect = aspect;
      // On a narrow screen the scene keeps its width.
      this.camera.fov = aspect > 1.2 ? 45 : (2 * Math.atan((Math.tan(Math.PI / 8) * 1.2) / aspect) * 180) / Math.PI;
      this.material.uniforms.least.value = 1.6 * this.pixelRatio;
      this.material.uniforms.scale.value = (height * this.pixelRatio) / (2 * Math.tan((this.camera.fov * Math.PI) / 360));
    }
    this.camera.updateProjectionMatrix();
    if (this.atHome) this.goHome();
    this.render();
  }

  setPointSize(times) {
    this.material.uniforms.size.value = this.spacing() * times;
    this.render();
  }

  coloursChanged() {
    this.colours.needsUpdate = true;
    this.render();
  }

  /** Draws once, soon. */
  render() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame((now) => {
      this.pending = false;
      this.controls.update();
      const points = this.pace.points(this.layout.drawn);
      this.geometry.setDrawRange(0, points);
      this.canvas.dataset.points = `${points} of ${this.layout.drawn}`;
      this.renderer.setClearColor(variable('--view'), 1);
      if (this.shading) {
        this.shading.render(this.scene, this.camera);
      } else {
        this.renderer.render(this.scene, this.camera);
      }
      for (const call of this.afterRender) call();
      if (this.pace.moving) requestAnimationFrame((next) => this.pace.took(next - now));
    });
  }

  /** [x, y] in the canvas, or undefined behind the camera. */
  toScreen(point) {
    const at = new THREE.Vector3(...point).project(this.camera);
    if (at.z > 1 || at.z < -1) return undefined;
    return [((at.x + 1) / 2) * this.width, ((1 - at.y) / 2) * this.height];
  }

  /** The point drawn under (x, y): the nearest to the eye of those within reach; -1 where there is none. */
  pick(x, y, reach = 9) {
    const m = new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse).elements;
    const p = this.layout.positions, colours = this.colours.array;
    const wx = (2 * x) / this.width - 1, wy = 1 - (2 * y) / this.height;
    const rx = (2 * reach) / this.width, ry = (2 * reach) / this.height;
    let best = -1, least = Infinity;
    for (let i = 0, o = 0; i < this.layout.drawn; ++i, o += 3) {
      if (colours[4 * i + 3] < 128) continue;
      const w = m[3] * p[o] + m[7] * p[o + 1] + m[11] * p[o + 2] + m[15];
      if (w <= 0) continue;
      const dx = ((m[0] * p[o] + m[4] * p[o + 1] + m[8] * p[o + 2] + m[12]) / w - wx) / rx;
      const dy = ((m[1] * p[o] + m[5] * p[o + 1] + m[9] * p[o + 2] + m[13]) / w - wy) / ry;
      const off = dx * dx + dy * dy;
      if (off > 1) continue;
      // A pixel beside the pointer counts as much as one part in fifty of the way to the eye.
      const cost = this.layout.flat ? off : w * (1 + 0.02 * off * reach);
      if (cost < least) {
        least = cost;
        best = i;
      }
    }
    return best;
  }
}
