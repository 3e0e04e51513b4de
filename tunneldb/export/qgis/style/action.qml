<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.0" styleCategories="AllStyleCategories" hasScaleBasedVisibilityFlag="0" minScale="0" maxScale="0" readOnly="0">
  <renderer-v2 type="RuleRenderer" forceraster="0" enableorderby="0" symbollevels="0">
    <rules key="action">
      <rule key="action0" symbol="0" label="Overdue" filter="&quot;overdue&quot;"/>
      <rule key="action1" symbol="1" label="Immediate or urgent" filter="NOT coalesce(&quot;overdue&quot;, false) AND &quot;state&quot; IN ('open', 'ordered') AND &quot;urgency&quot; IN ('immediate', 'urgent')"/>
      <rule key="action2" symbol="2" label="Planned" filter="NOT coalesce(&quot;overdue&quot;, false) AND &quot;state&quot; IN ('open', 'ordered') AND &quot;urgency&quot; = 'planned'"/>
      <rule key="action3" symbol="3" label="Monitor" filter="NOT coalesce(&quot;overdue&quot;, false) AND &quot;state&quot; IN ('open', 'ordered') AND &quot;urgency&quot; = 'monitor'"/>
      <rule key="action4" symbol="4" label="Done or verified" filter="&quot;state&quot; IN ('done', 'verified')"/>
    </rules>
    <symbols>
      <symbol name="0" type="marker" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="diamond" name="name"/>
            <Option type="QString" value="200,0,0,255" name="color"/>
            <Option type="QString" value="5.2" name="size"/>
            <Option type="QString" value="MM" name="size_unit"/>
            <Option type="QString" value="255,255,255,255" name="outline_color"/>
            <Option type="QString" value="0.6" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="round" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="marker" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="diamond" name="name"/>
            <Option type="QString" value="230,126,0,255" name="color"/>
            <Option type="QString" value="4.4" name="size"/>
            <Option type="QString" value="MM" name="size_unit"/>
            <Option type="QString" value="255,255,255,255" name="outline_color"/>
            <Option type="QString" value="0.4" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="round" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="2" type="marker" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="diamond" name="name"/>
            <Option type="QString" value="0,92,175,255" name="color"/>
            <Option type="QString" value="4.0" name="size"/>
            <Option type="QString" value="MM" name="size_unit"/>
            <Option type="QString" value="255,255,255,255" name="outline_color"/>
            <Option type="QString" value="0.4" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="round" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="3" type="marker" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="diamond" name="name"/>
            <Option type="QString" value="110,110,110,255" name="color"/>
            <Option type="QString" value="3.6" name="size"/>
            <Option type="QString" value="MM" name="size_unit"/>
            <Option type="QString" value="255,255,255,255" name="outline_color"/>
            <Option type="QString" value="0.4" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="round" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="4" type="marker" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="diamond" name="name"/>
            <Option type="QString" value="255,255,255,200" name="color"/>
            <Option type="QString" value="3.6" name="size"/>
            <Option type="QString" value="MM" name="size_unit"/>
            <Option type="QString" value="47,125,66,255" name="outline_color"/>
            <Option type="QString" value="0.6" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="round" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <labeling type="simple">
    <settings calloutType="simple">
      <text-style fieldName="&quot;measure&quot;" isExpression="1" fontFamily="Sans Serif" namedStyle="Bold" fontWeight="75" fontSize="8" fontSizeUnit="Point" textColor="30,30,30,255" textOpacity="1" multilineHeight="1" allowHtml="0">
        <text-buffer bufferDraw="1" bufferSize="0.8" bufferSizeUnits="MM" bufferColor="255,255,255,230" bufferOpacity="1" bufferJoinStyle="128" bufferNoFill="1"/>
        <background shapeDraw="0"/>
        <shadow shadowDraw="0"/>
      </text-style>
      <text-format autoWrapLength="30" wrapChar="" multilineAlign="0" useMaxLineLengthForAutoWrap="1" formatNumbers="0" decimals="3" plussign="0"/>
      <placement placement="1" dist="1.2" distUnits="MM" placementFlags="10" quadOffset="5" xOffset="3.4" yOffset="0" offsetUnits="MM" priority="7"/>
      <rendering scaleVisibility="1" scaleMin="0" scaleMax="4000" obstacle="0" obstacleFactor="1" displayAll="0" drawLabels="1" upsidedownLabels="0" fontLimitPixelSize="0" mergeLines="0" limitNumLabels="0" minFeatureSize="0"/>
    </settings>
  </labeling>
  <fieldConfiguration>
    <field name="id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="survey_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="survey" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="tunnel_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="tunnel" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="finding_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="finding_kind" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="element" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="chainage_from" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" value="true" name="AllowNull"/>
            <Option type="int" value="3" name="Precision"/>
            <Option type="QString" value="SpinBox" name="Style"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="chainage_to" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" value="true" name="AllowNull"/>
            <Option type="int" value="3" name="Precision"/>
            <Option type="QString" value="SpinBox" name="Style"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="arc" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="label" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="measure" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="true" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="urgency" configurationFlags="None">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option type="List" name="map">
              <Option type="Map">
                <Option type="QString" value="immediate" name="Immediate"/>
              </Option>
              <Option type="Map">
                <Option type="QString" value="urgent" name="Urgent"/>
              </Option>
              <Option type="Map">
                <Option type="QString" value="planned" name="Planned"/>
              </Option>
              <Option type="Map">
                <Option type="QString" value="monitor" name="Monitor (observe only)"/>
              </Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="responsible" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="due" configurationFlags="None">
      <editWidget type="DateTime">
        <config>
          <Option type="Map">
            <Option type="bool" value="true" name="allow_null"/>
            <Option type="bool" value="true" name="calendar_popup"/>
            <Option type="QString" value="yyyy-MM-dd" name="display_format"/>
            <Option type="QString" value="yyyy-MM-dd" name="field_format"/>
            <Option type="bool" value="false" name="field_iso_format"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="overdue" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="cost" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" value="true" name="AllowNull"/>
            <Option type="double" value="0.0" name="Min"/>
            <Option type="double" value="1000000000.0" name="Max"/>
            <Option type="double" value="100.0" name="Step"/>
            <Option type="int" value="2" name="Precision"/>
            <Option type="QString" value="SpinBox" name="Style"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="currency" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="state" configurationFlags="None">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option type="List" name="map">
              <Option type="Map">
                <Option type="QString" value="open" name="Open"/>
              </Option>
              <Option type="Map">
                <Option type="QString" value="ordered" name="Ordered"/>
              </Option>
              <Option type="Map">
                <Option type="QString" value="done" name="Done"/>
              </Option>
              <Option type="Map">
                <Option type="QString" value="verified" name="Verified"/>
              </Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="remark" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="true" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="photos" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="follow_up" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="added_by" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="added_at" configurationFlags="None">
      <editWidget type="DateTime">
        <config>
          <Option type="Map">
            <Option type="bool" value="true" name="allow_null"/>
            <Option type="bool" value="true" name="calendar_popup"/>
            <Option type="QString" value="yyyy-MM-dd HH:mm" name="display_format"/>
            <Option type="bool" value="false" name="field_iso_format"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="changed_by" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="changed_at" configurationFlags="None">
      <editWidget type="DateTime">
        <config>
          <Option type="Map">
            <Option type="bool" value="true" name="allow_null"/>
            <Option type="bool" value="true" name="calendar_popup"/>
            <Option type="QString" value="yyyy-MM-dd HH:mm" name="display_format"/>
            <Option type="bool" value="false" name="field_iso_format"/>
          </Option>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" field="id" name="Number"/>
    <alias index="1" field="survey_id" name="Survey key"/>
    <alias index="2" field="survey" name="Survey"/>
    <alias index="3" field="tunnel_id" name="Tunnel key"/>
    <alias index="4" field="tunnel" name="Tunnel"/>
    <alias index="5" field="finding_id" name="Finding"/>
    <alias index="6" field="finding_kind" name="Kind of the finding"/>
    <alias index="7" field="element" name="Element"/>
    <alias index="8" field="chainage_from" name="Chainage from (m)"/>
    <alias index="9" field="chainage_to" name="Chainage to (m)"/>
    <alias index="10" field="arc" name="Arc (m)"/>
    <alias index="11" field="label" name="Chainage"/>
    <alias index="12" field="measure" name="Measure"/>
    <alias index="13" field="urgency" name="Urgency"/>
    <alias index="14" field="responsible" name="Responsible"/>
    <alias index="15" field="due" name="Due"/>
    <alias index="16" field="overdue" name="Overdue"/>
    <alias index="17" field="cost" name="Cost"/>
    <alias index="18" field="currency" name="Currency"/>
    <alias index="19" field="state" name="State"/>
    <alias index="20" field="remark" name="Remark"/>
    <alias index="21" field="photos" name="Photos"/>
    <alias index="22" field="follow_up" name="In later surveys"/>
    <alias index="23" field="added_by" name="Added by"/>
    <alias index="24" field="added_at" name="Added at"/>
    <alias index="25" field="changed_by" name="Changed by"/>
    <alias index="26" field="changed_at" name="Changed at"/>
  </aliases>
  <editable>
    <field name="id" editable="0"/>
    <field name="survey_id" editable="0"/>
    <field name="survey" editable="1"/>
    <field name="tunnel_id" editable="0"/>
    <field name="tunnel" editable="0"/>
    <field name="finding_id" editable="1"/>
    <field name="finding_kind" editable="0"/>
    <field name="element" editable="1"/>
    <field name="chainage_from" editable="1"/>
    <field name="chainage_to" editable="1"/>
    <field name="arc" editable="1"/>
    <field name="label" editable="0"/>
    <field name="measure" editable="1"/>
    <field name="urgency" editable="1"/>
    <field name="responsible" editable="1"/>
    <field name="due" editable="1"/>
    <field name="overdue" editable="0"/>
    <field name="cost" editable="1"/>
    <field name="currency" editable="1"/>
    <field name="state" editable="1"/>
    <field name="remark" editable="1"/>
    <field name="photos" editable="0"/>
    <field name="follow_up" editable="0"/>
    <field name="added_by" editable="0"/>
    <field name="added_at" editable="0"/>
    <field name="changed_by" editable="0"/>
    <field name="changed_at" editable="0"/>
  </editable>
  <constraints>
    <constraint field="measure" constraints="1" notnull_strength="1" unique_strength="0" exp_strength="0"/>
    <constraint field="id" constraints="3" notnull_strength="2" unique_strength="2" exp_strength="0"/>
  </constraints>
  <editorlayout>tablayout</editorlayout>
  <attributeEditorForm>
    <attributeEditorContainer name="Action" columnCount="1" groupBox="0" showLabel="1" visibilityExpressionEnabled="0" visibilityExpression="">
      <attributeEditorField name="measure" index="12" showLabel="1"/>
      <attributeEditorField name="urgency" index="13" showLabel="1"/>
      <attributeEditorField name="state" index="19" showLabel="1"/>
      <attributeEditorField name="responsible" index="14" showLabel="1"/>
      <attributeEditorField name="due" index="15" showLabel="1"/>
      <attributeEditorField name="cost" index="17" showLabel="1"/>
      <attributeEditorField name="currency" index="18" showLabel="1"/>
      <attributeEditorField name="remark" index="20" showLabel="1"/>
      <attributeEditorField name="finding_id" index="5" showLabel="1"/>
      <attributeEditorField name="element" index="7" showLabel="1"/>
      <attributeEditorField name="chainage_from" index="8" showLabel="1"/>
      <attributeEditorField name="chainage_to" index="9" showLabel="1"/>
    </attributeEditorContainer>
    <attributeEditorContainer name="Facts, worked out by the database" columnCount="2" groupBox="0" showLabel="1" visibilityExpressionEnabled="1" visibilityExpression="&quot;label&quot; IS NOT NULL">
      <attributeEditorField name="id" index="0" showLabel="1"/>
      <attributeEditorField name="label" index="11" showLabel="1"/>
      <attributeEditorField name="survey" index="2" showLabel="1"/>
      <attributeEditorField name="tunnel" index="4" showLabel="1"/>
      <attributeEditorField name="finding_kind" index="6" showLabel="1"/>
      <attributeEditorField name="overdue" index="16" showLabel="1"/>
      <attributeEditorField name="follow_up" index="22" showLabel="1"/>
      <attributeEditorField name="photos" index="21" showLabel="1"/>
      <attributeEditorField name="arc" index="10" showLabel="1"/>
      <attributeEditorField name="added_by" index="23" showLabel="1"/>
      <attributeEditorField name="added_at" index="24" showLabel="1"/>
      <attributeEditorField name="changed_by" index="25" showLabel="1"/>
      <attributeEditorField name="changed_at" index="26" showLabel="1"/>
    </attributeEditorContainer>
  </attributeEditorForm>
  <previewExpression>"id" || ' ' || "measure"</previewExpression>
  <mapTip>&lt;b&gt;[% replace("measure", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]&lt;/b&gt;, [% replace("label", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]&lt;br&gt;[% replace("urgency", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %], [% replace("state", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %][% if("overdue", ', &lt;b&gt;overdue&lt;/b&gt;', '') %][% coalesce('&lt;br&gt;due ' || format_date("due", 'yyyy-MM-dd'), '') %][% coalesce('&lt;br&gt;' || replace("responsible", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')), '') %][% coalesce('&lt;br&gt;since then: ' || replace("follow_up", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')), '') %][% coalesce('&lt;br&gt;' || replace("remark", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')), '') %]</mapTip>
  <layerGeometryType>0</layerGeometryType>
</qgis>
