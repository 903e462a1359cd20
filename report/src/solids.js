// What is put into the scene beside the points: hulls of found models, spheres around things, the particles of a step.
import * as THREE from 'three';
import {Line2} from 'three/addons/lines/Line2.js';
import {LineGeometry} from 'three/addons/lines/LineGeometry.js';
import {LineMaterial} from 'three/addons/lines/LineMaterial.js';

import {css} from './colours.js';
import {across, pieces} from './hulls.js';
import {barrel, outline, planeInBox, ring, segment} from './shapes.js';

const veil = (colour, opacity) =>
  new THREE.MeshBasicMaterial({color: css(colour), transparent: true, opacity, side: THREE.DoubleSide, depthWrite: false});

function fan(corners) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(corners.flat(), 3));
  const index = [];
  for (let k = 2; k < corners.length; ++k) index.push(0, k - 1, k);
  geometry.setIndex(index);
  return geometry;
}

/** Things that are drawn over the points, where these do not hide them. */
function above(object) {
  object.renderOrder = 2;
  return object;
}

/** A line of so many pixels. */
export function stroke(points, colour, width, opacity = 1) {
  const geometry = new LineGeometry().setPositions(points.flat());
  return above(new Line2(geometry, new LineMaterial({color: css(colour), linewidth: width, transparent: true, opacity, depthWrite: false})));
}

function planeHulls(p, colour, positions, members, group) {
  const normal = [p[0], p[1], p[2]], [u, v] = across(normal);
  const flat = new Float32Array(2 * members.length);
  members.forEach((i, k) => {
    const x = positions[3 * i], y = positions[3 * i + 1], z = positions[3 * i + 2];
    flat[2 * k] = x * u[0] + y * u[1] + z * u[2];
    flat[2 * k + 1] = x * v[0] + y * v[1] + z * v[2];
  });
  for (const piece of pieces(flat)) {
    if (piece.length < 3) continue;
    const corners = piece.map(([a, b]) => u.map((c, d) => a * c + b * v[d] - p[3] * normal[d]));
    group.add(new THREE.Mesh(fan(corners), veil(colour, 0.26)), stroke([...corners, corners[0]], colour, 2, 0.9));
    group.userData.anchor ??= [0, 1, 2].map((d) => corners.reduce((sum, c) => sum + c[d], 0) / corners.length);
  }
}

/** On both sides of a line or circle, as far as its inliers reach. */
function band(points, normalAt, width, colour) {
  const strip = [];
  points.forEach((p, k) => {
    const n = normalAt(k);
    strip.push(p[0] + width * n[0], p[1] + width * n[1], -1e-3, p[0] - width * n[0], p[1] - width * n[1], -1e-3);
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(strip, 3));
  const index = [];
  for (let k = 0; k + 1 < points.length; ++k) index.push(2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 1, 2 * k + 3, 2 * k + 2);
  geometry.setIndex(index);
  return new THREE.Mesh(geometry, veil(colour, 0.18));
}

/** A found model, as far as its points reach. `userData.anchor` is where its number goes. */
export function modelShape(type, p, colour, positions, members, threshold) {
  const group = new THREE.Group();
  if (members.length < 2) return group;
  switch (type) {
    case 'plane': planeHulls(p, colour, positions, members, group); break;
    case 'line2d': {
      const ends = segment(p, positions, members);
      group.add(band(ends, () => p, threshold, colour), stroke(ends, colour, 3));
      group.userData.anchor = ends[1];
      break;
    }
    case 'circle2d': {
      const around = ring([p[0], p[1], 0], [0, 0, 1], p[2], 96);
      group.add(band(around, (k) => [around[k][0] - p[0], around[k][1] - p[1]].map((v) => v / p[2]), threshold, colour), stroke(around, colour, 3));
      group.userData.anchor = around[12];
      break;
    }
    case 'sphere': group.add(ball([p[0], p[1], p[2]], p[3], colour, 0.2)); break;
    case 'cylinder': {
      const {middle, axis, length, radius} = barrel(p, positions, members);
      const mesh = above(new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, length, 48, 1, true), veil(colour, 0.24)));
      mesh.position.set(...middle);
      mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...axis));
      group.add(mesh);
      for (const end of [-0.5, 0.5]) group.add(stroke(ring(middle.map((v, d) => v + end * length * axis[d]), axis, radius), colour, 2, 0.9));
      group.userData.anchor = middle;
      break;
    }
    default: break;
  }
  return group;
}

/** A sphere that lets through what is in it: its rim is seen more than its middle. */
export function ball(centre, radius, colour, opacity = 0.14) {
  const group = new THREE.Group();
  const material = new THREE.ShaderMaterial({
    uniforms: {colour: {value: new THREE.Color(css(colour))}, opacity: {value: opacity}},
    vertexShader: `
      varying vec3 normal_seen, eye;
      void main() {
        vec4 at = modelViewMatrix * vec4(position, 1.0);
        normal_seen = normalMatrix * normal;
        eye = -at.xyz;
        gl_Position = projectionMatrix * at;
      }`,
    fragmentShader: `
      uniform vec3 colour;
      uniform float opacity;
      varying vec3 normal_seen, eye;
      void main() {
        float rim = 1.0 - abs(dot(normalize(normal_seen), normalize(eye)));
        gl_FragColor = vec4(colour, opacity * (0.35 + 3.0 * pow(rim, 2.5)));
      }`,
    transparent: true,
    depthWrite: false,
  });
  const mesh = above(new THREE.Mesh(new THREE.SphereGeometry(radius, 40, 24), material));
  mesh.position.set(...centre);
  group.add(mesh);
  group.userData.anchor = centre;
  return group;
}

/** The particles of one step as thin lines, `colourOf(particle)` each. */
export function swarm(step, box, colourOf) {
  const positions = [], colours = [];
  step.shares.forEach((share, j) => {
    const p = step.particles.subarray(j * step.width, (j + 1) * step.width);
    const colour = colourOf(share).map((c) => c / 255);
    for (const line of outline(step.type, p, box)) {
      for (let k = 0; k + 1 < line.length; ++k) {
        positions.push(...line[k], ...line[k + 1]);
        colours.push(...colour, ...colour);
      }
    }
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
  geometry.setAttribute('color', new THREE.Float32BufferAttribute(colours, 3));
  return above(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({vertexColors: true, transparent: true, opacity: 0.7, depthWrite: false})));
}

/** The global best of a step: what it covers of the box, and its border. */
export function best(step, box, colour) {
  const group = new THREE.Group();
  if (step.type === 'plane') {
    const polygon = planeInBox(step.best, box);
    if (polygon.length > 2) group.add(above(new THREE.Mesh(fan(polygon), veil(colour, 0.22))));
  }
  for (const line of outline(step.type, step.best, box)) group.add(stroke(line, colour, 3.5));
  return group;
}

export function dispose(object) {
  object.traverse((part) => {
    part.geometry?.dispose();
    part.material?.dispose();
  });
  object.removeFromParent();
}
